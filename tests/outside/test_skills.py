"""A skill or a run that was saved is the one that was there before, bit for bit, or it is refused."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
import tiny
from damage import DAMAGES, flip, forged, forged_tensors
from hypothesis import given
from hypothesis import strategies as st

import toddle
from toddle.failures import BadInput
from toddle.outside.skills import load_skill, read_run, resume, save, save_run
from toddle.reach.config import ReachConfig
from toddle.reach.session import open_session
from toddle.reach.skill import Skill
from toddle.reach.solve.query import query_of
from toddle.robots.catalogue import Choice
from toddle.robots.planar import planar

TARGETS = np.random.default_rng(0).uniform(-1, 1, (50, 2))


def leaves(tree: Any) -> list[np.ndarray]:
    """Every array of a pytree, random keys as their numbers."""
    is_key = lambda leaf: jax.numpy.issubdtype(leaf.dtype, jax.dtypes.prng_key)  # noqa: E731
    return [np.asarray(jax.random.key_data(leaf) if is_key(leaf) else leaf) for leaf in jax.tree.leaves(tree)]


def equal(a: Any, b: Any) -> bool:
    """Whether two pytrees hold the same bits."""
    pairs = zip(leaves(a), leaves(b), strict=True)
    return all(x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes() for x, y in pairs)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(tiny.skill(), tmp_path_factory.mktemp("skills") / "a" / "skill")


@pytest.mark.parametrize("kind", ["refined", "plain", "local-linear"])
def test_a_saved_skill_answers_as_it_did_bit_for_bit(kind: str, tmp_path: Path) -> None:
    skills = {"refined": tiny.skill, "plain": tiny.plain_skill, "local-linear": tiny.local_linear_skill}
    skill = skills[kind]()
    found = tiny.inverse(load_skill(save(skill, tmp_path / "skill")))
    assert found.predict(TARGETS).tobytes() == skill.predict(TARGETS).tobytes()
    assert query_of(found)(TARGETS[0]).tobytes() == query_of(skill)(TARGETS[0]).tobytes()
    for target in skill.seen[:5]:
        before, after = (toddle.solve(s, target, robot=planar(2)) for s in (skill, found))
        assert before.q.tobytes() == after.q.tobytes()
        assert replace(before, q=after.q) == after
    assert equal((found.state, found.box), (skill.state, skill.box))
    for name in ("source", "joints", "config", "hidden", "figures"):
        assert getattr(found, name) == getattr(skill, name), name
    for name in ("home", "seen", "postures", "targets", "errors"):
        assert getattr(found, name).tobytes() == getattr(skill, name).tobytes(), name


def test_what_the_robot_was_cut_from_is_remembered(tmp_path: Path) -> None:
    source = Choice("arm.urdf", "hand", "floor", ("turn", "lift"))
    found = load_skill(save(replace(tiny.skill(), source=source), tmp_path))
    assert found.source == source


def test_saving_again_writes_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    again = save(load_skill(folder), tmp_path)
    for name in ("skill.json", "skill.safetensors"):
        assert (again / name).read_bytes() == (folder / name).read_bytes()


@given(st.sampled_from(["json", "safetensors"]), st.floats(0, 1), st.integers(1, 255))
def test_a_skill_with_any_byte_changed_is_refused(folder: Path, ending: str, share: float, bits: int) -> None:
    path = folder / f"skill.{ending}"
    before = path.read_bytes()
    try:
        flip(path, share, bits)
        with pytest.raises(BadInput) as refusal:
            load_skill(folder)
        assert str(folder) in refusal.value.line
    finally:
        path.write_bytes(before)


def _first(array: np.ndarray, value: float) -> np.ndarray:
    changed = array.copy()
    changed.flat[0] = value
    return changed


FORGERIES = {
    "a weight that is not finite": forged_tensors(lambda a: a.update(errors=_first(a["errors"], np.nan))),
    "an infinite target": forged_tensors(lambda a: a.update(targets=_first(a["targets"], np.inf))),
    "more errors than targets": forged_tensors(lambda a: a.update(errors=np.append(a["errors"], 0.0))),
    "no targets": forged_tensors(lambda a: a.update(targets=a["targets"][:0], errors=a["errors"][:0])),
    "nothing seen": forged_tensors(lambda a: a.update(seen=a["seen"][:0])),
    "seen in space, targets in the plane": forged_tensors(lambda a: a.update(seen=np.zeros((5, 3)))),
    "fewer postures than positions": forged_tensors(lambda a: a.update(postures=a["postures"][1:])),
    "a box of other dimensions": forged_tensors(lambda a: a.update({"box.space_span": np.ones(3, np.float32)})),
    "a home of one joint": forged_tensors(lambda a: a.update(home=np.zeros(1))),
    "a name too many": forged(lambda record: record["facts"]["joints"].append("more")),
    "a joint without name": forged(lambda record: record["facts"].update(joints=["a", None])),
    "a robot that is a number": forged(lambda record: record["facts"]["source"].update(spec=1)),
    "a tip that is a list": forged(lambda record: record["facts"]["source"].update(tip=["x"])),
    "no robot": forged(lambda record: record["facts"].pop("source")),
    "figures that are a number": forged(lambda record: record["facts"].update(figures=1)),
    "an unknown network": forged(lambda record: record["facts"]["config"].update(network="deep")),
    "a learner that is a list": forged(lambda record: record["facts"]["config"].update(learner=[])),
    "hidden layers that are words": forged(lambda record: record["facts"].update(hidden=["many"])),
    "hidden layers without end": forged(lambda record: record["facts"].update(hidden=[10**9])),
}


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", FORGERIES)
def test_a_skill_that_does_not_fit_together_is_refused(name: str, folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    FORGERIES[name](copy / "skill.json", copy / "skill.safetensors")
    with pytest.raises(BadInput, match="it is not a skill of this version"):
        load_skill(copy)


def _saved_run(tmp_path: Path) -> Path:
    save_run(tmp_path, tiny.session(), tiny.course()[1], {"anything": [1, None]})
    return tmp_path


def test_a_saved_run_is_taken_up_as_it_was(tmp_path: Path) -> None:
    config, facts, tensors = read_run(_saved_run(tmp_path))
    assert config == tiny.session().config
    assert facts == {"anything": [1, None]}
    session = open_session(planar(2), config)
    cycle = resume(session, tensors, "here")
    assert equal(cycle.progress, tiny.course()[1].progress)
    assert equal(cycle.history, tiny.course()[1].history)
    assert cycle.samples == 200


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", [name for name, (_, says) in DAMAGES.items() if says])
def test_a_damaged_run_is_refused_before_it_is_used(name: str, tmp_path: Path) -> None:
    pair = (_saved_run(tmp_path) / "run.json", tmp_path / "run.safetensors")
    if name == "forged: an unknown method":
        return  # a run's method is looked up when its session is opened
    DAMAGES[name][0](*pair)
    with pytest.raises(BadInput):
        read_run(tmp_path)


OTHERS = {
    "more joints": lambda: open_session(planar(3), tiny.session().config),
    "other limits": lambda: open_session(planar(2, limit=1.5), tiny.session().config),
    "other lengths": lambda: open_session(planar(2, length=1.02), tiny.session().config),
    "another network": lambda: open_session(planar(2), replace(tiny.session().config, hidden=(5,))),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_run_of_another_robot_is_refused(name: str, tmp_path: Path) -> None:
    _, _, tensors = read_run(_saved_run(tmp_path))
    with pytest.raises(BadInput, match=r"^here: it does not fit this robot \(.*\); learn it again$"):
        resume(OTHERS[name](), tensors, "here")


def test_a_configuration_is_the_same_after_a_round_trip(tmp_path: Path) -> None:
    config = ReachConfig(samples=10**7, seed=2**32 - 1, hidden=(), learning_rate=0.1, test_spacing=1 / 3)
    session = replace(tiny.session(), config=config)
    save_run(tmp_path, session, tiny.course()[0], {})
    assert read_run(tmp_path)[0] == config


def test_the_skill_in_memory_is_not_changed_by_saving(tmp_path: Path) -> None:
    skill: Skill = tiny.skill()
    before = leaves((skill.state, skill.box, skill.seen))
    save(skill, tmp_path)
    assert equal(before, leaves((skill.state, skill.box, skill.seen)))
