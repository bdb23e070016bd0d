"""What was exported answers as toddle does, without toddle: the same body, the same limits, judged by the true arm."""

from __future__ import annotations

import functools
import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnxruntime
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from toddle.failures import BadInput, MissingExtra
from toddle.outside.export import _inward, export
from toddle.outside.export_jax import JaxOps
from toddle.outside.export_models import forward_of
from toddle.reach.body_config import BodyConfig
from toddle.reach.body_run import Plan, skill_from
from toddle.reach.body_skill import BodySkill, turn_of
from toddle.reach.model.covariance import Doubt, Embedding
from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import Curvature
from toddle.reach.model.curvature_chain import Shape, places, tips
from toddle.reach.model.curvature_rest import Mended, Rest
from toddle.reach.model.kernel import Kernel
from toddle.reach.model.model import Fit, Model, PoseModel
from toddle.reach.model.multilinear import Multilinear
from toddle.reach.model.network import Layer, Network
from toddle.reach.model.rigid import Rigid, changed
from toddle.reach.structures import Known
from toddle.robots.catalogue import Choice
from toddle.robots.linkage import Linkage, poses
from toddle.signals import Experience

COUNT, NOISE, TURN_NOISE = 512, 1e-3, 5e-3
FORMATS = ".onnx", ".jax"
Answer = Callable[..., dict[str, Any]]
SOFT = Shape((3, 3), 1, np.full(6, 0.2), np.full(6, 0.05), 3)


def frame(turn: tuple[float, float, float], shift: tuple[float, float, float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_euler("xyz", turn).as_matrix(), shift
    return matrix


def arm() -> Linkage:
    """Six joints: the third one slides, the fifth moves two axes."""
    right = np.pi / 2
    places = [
        frame((0, 0, 0), (0, 0, 0.2)), frame((right, 0, 0), (0.05, 0, 0.1)), frame((0, right, 0), (0.3, 0, 0)),
        frame((0, 0, 0), (0, 0.02, 0.1)), frame((-right, 0, 0), (0, 0.1, 0)), frame((0, 0, 0), (0.05, 0, 0)),
        frame((right, 0.1, 0), (0.08, 0, 0.05)),
    ]  # fmt: skip
    gain = np.zeros((7, 6))
    gain[range(7), [0, 1, 2, 3, 4, 4, 5]] = 1, -1, 1, 1, 1, 0.5, 1
    return Linkage(np.array(places), np.eye(7)[2], gain, np.zeros(7), frame((0.3, 0, 0.2), (0, 0.05, 0.1)))


def planar() -> Linkage:
    steps = [frame((0, 0, 0), (length, 0, 0)) for length in (0.0, 0.4, 0.3)]
    return Linkage(np.array(steps), np.zeros(3), np.eye(3), np.zeros(3), frame((0, 0, 0), (0.2, 0, 0)))


def soft_numbers() -> np.ndarray:
    numbers, where = np.zeros(places(SOFT).total), places(SOFT)
    for part in where.segments:
        numbers[part] = np.array([[0, 0.9, -0.45, -0.45], [0, 0, 0.8, -0.8], [0.25, 0.02, 0.02, 0.02]]).ravel()
    numbers[where.gaps], numbers[where.tip] = 0.03, (0.01, 0.0, 0.05)
    return numbers


class Arm:
    """A body as it truly is, and the skill that was learned from its noisy movements."""

    def __init__(self, name: str) -> None:
        rng = np.random.default_rng(4)
        self.turned, self.coordinates = name == "arm", (0, 1) if name == "planar" else (0, 1, 2)
        self.soft, self.linkage = name == "soft", arm() if name == "arm" else planar()
        lower, upper = np.full(6, -1.5), np.full(6, 1.5)
        if name == "arm":
            lower[2], upper[2] = 0.0, 0.25
        if name == "soft":
            lower, upper = SOFT.middle - SOFT.half, SOFT.middle + SOFT.half
        if name == "planar":
            lower, upper = np.full(3, -2.0), np.full(3, 2.0)
        self.lower, self.upper = lower, upper
        q = self.postures(300, 1)
        x, turn = self.at(q), None
        if self.turned:
            shaken = Rotation.from_rotvec(TURN_NOISE * rng.normal(size=(len(q), 3))).as_matrix()
            turn = shaken @ self.turns(q)
        experience = Experience(q, x + NOISE * rng.normal(size=x.shape), turn)
        known = Known(tuple(f"joint {i}" for i in range(len(lower))), lower, upper, (lower + upper) / 2)
        if name == "arm":
            self.skill = self.nearly_right(known, experience)
            return
        config = BodyConfig(movements=len(q), noise=NOISE)
        structure = "curvature" if name == "soft" else "screws"
        self.skill = skill_from(experience, Plan(config, (structure,), "", known, q), Choice(name))

    def nearly_right(self, known: Known, experience: Experience) -> BodySkill:
        """A skill whose constants are off by about 0.1 mm and 0.1 mrad, without the cost of a fit."""
        numbers = 7 * len(self.linkage.slides) + 6
        off = 1e-4 * np.random.default_rng(8).normal(size=numbers)
        model = Rigid(changed(self.linkage, off), 1e-8 * np.eye(numbers))
        miss = np.linalg.norm(experience.x - model.forward(experience.q), axis=1)
        fit = Fit(model, "screws", miss, NOISE, np.zeros(len(miss), bool), 0.0)
        skill = learned("planar").skill
        return replace(skill, joints=known.joints, lower=known.lower, upper=known.upper, home=known.home, fit=fit,
                       experience=experience, targets=np.empty((0, 3)))  # fmt: skip

    def postures(self, count: int, seed: int) -> np.ndarray:
        return np.random.default_rng(seed).uniform(self.lower, self.upper, (count, len(self.lower)))

    def at(self, q: np.ndarray) -> np.ndarray:
        if self.soft:
            return tips(SOFT, soft_numbers(), q)
        return poses(self.linkage, q)[:, self.coordinates, 3]

    def turns(self, q: np.ndarray) -> np.ndarray:
        return poses(self.linkage, q)[:, :3, :3]


learned = functools.cache(Arm)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("exported")


def opened(path: Path) -> Answer:
    """What a user does with the file."""
    if path.suffix == ".jax":
        exported = jax.export.deserialize(bytearray(path.read_bytes()))
        call = jax.jit(exported.call)
        return lambda *given: {name: np.asarray(value) for name, value in call(*given).items()}
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    into, out = ([value.name for value in values] for values in (session.get_inputs(), session.get_outputs()))
    return lambda *given: dict(zip(out, session.run(None, dict(zip(into, given, strict=True))), strict=True))


@pytest.fixture(scope="module")
def answers(folder: Path) -> Callable[[str, str], Answer]:
    @functools.cache
    def answer(name: str, ending: str) -> Answer:
        path = folder / f"{name}{ending}"
        export(learned(name).skill, path)
        return opened(path)

    return answer


def asked(name: str, q: np.ndarray, *, of: str = "model") -> tuple[np.ndarray, ...]:
    """Targets that a posture reaches, on the model or on the true body, as a user gives them."""
    body = learned(name)
    model = body.skill.fit.model
    if body.turned:
        assert isinstance(model, PoseModel)
        pose = model.pose(q) if of == "model" else poses(body.linkage, q)
        quaternion = Rotation.from_matrix(pose[:, :3, :3]).as_quat(scalar_first=True)
        return pose[:, :3, 3].astype(np.float32), quaternion.astype(np.float32)
    return ((model.forward(q) if of == "model" else body.at(q)).astype(np.float32),)


CASES = [("arm", ".onnx"), ("planar", ".onnx"), ("soft", ".onnx"), ("arm", ".jax"), ("soft", ".jax")]


@pytest.mark.parametrize(("name", "ending"), CASES)
def test_unseen_targets_are_reached_within_the_limits(
    name: str, ending: str, answers: Callable[[str, str], Answer]
) -> None:
    skill, given = learned(name).skill, asked(name, learned(name).postures(COUNT, 2))
    found = answers(name, ending)(*given)
    q = found["joints"].astype(float)
    assert np.all((skill.lower <= q) & (q <= skill.upper))
    distance = np.linalg.norm(skill.fit.model.forward(q) - given[0], axis=1)
    np.testing.assert_allclose(found["distance"], distance, atol=2e-6)
    assert np.mean(distance < 1e-4) >= 0.99
    if learned(name).turned:
        assert isinstance(skill.fit.model, PoseModel)
        missing = turn_of_all(given[1]) @ skill.fit.model.pose(q)[:, :3, :3].transpose(0, 2, 1)
        angle = Rotation.from_matrix(missing).magnitude()
        np.testing.assert_allclose(found["angle"], angle, atol=2e-5)
        assert np.mean((distance < 1e-4) & (angle < 1e-3)) >= 0.99


def turn_of_all(quaternions: np.ndarray) -> np.ndarray:
    return np.stack([turn_of(q / np.linalg.norm(q)) for q in quaternions.astype(float)])


@pytest.mark.parametrize("name", ["arm", "planar", "soft"])
def test_the_true_body_goes_where_it_goes_by_toddles_own_answers(
    name: str, answers: Callable[[str, str], Answer]
) -> None:
    body, given = learned(name), asked(name, learned(name).postures(COUNT, 3), of="truth")
    own = body.skill.predict(given[0], turn_of_all(given[1]) if body.turned else None)
    theirs = answers(name, ".onnx")(*given)["joints"].astype(float)
    worst = [np.quantile(np.linalg.norm(body.at(q) - given[0], axis=1), 0.99) for q in (own, theirs)]
    assert abs(worst[1] - worst[0]) < 0.2e-3
    assert worst[1] < 5e-3


@pytest.mark.parametrize(("name", "ending"), CASES)
def test_an_answer_does_not_depend_on_the_batch(name: str, ending: str, answers: Callable[[str, str], Answer]) -> None:
    answer, given = answers(name, ending), asked(name, learned(name).postures(COUNT, 2))
    together = answer(*given)["joints"]
    alone = [answer(*(part[i : i + 1] for part in given))["joints"][0] for i in range(12)]
    np.testing.assert_allclose(together[:12], alone, atol=1e-3)


def test_both_formats_answer_alike(answers: Callable[[str, str], Answer]) -> None:
    given = asked("arm", learned("arm").postures(COUNT, 2))
    one, other = (answers("arm", ending)(*given)["joints"] for ending in FORMATS)
    assert np.mean(np.max(np.abs(one - other), axis=1) < 1e-3) > 0.97


def test_a_target_out_of_reach_is_come_as_near_to_as_toddle_does(answers: Callable[[str, str], Answer]) -> None:
    body = learned("planar")
    angle = np.linspace(0, 6, 40)
    targets = np.stack([1.2 * np.cos(angle), 1.2 * np.sin(angle)], axis=1).astype(np.float32)
    found = answers("planar", ".onnx")(targets)
    nearest = [body.skill.solver.nearest(target)[1] for target in targets.astype(float)]
    assert np.all(found["joints"] <= body.skill.upper)
    np.testing.assert_allclose(found["distance"], nearest, atol=1e-3)
    assert min(nearest) > 0.2


def test_a_quaternion_of_zeros_asks_for_no_orientation(answers: Callable[[str, str], Answer]) -> None:
    given = asked("arm", learned("arm").postures(64, 5))
    answer = answers("arm", ".onnx")
    free = answer(given[0], np.zeros_like(given[1]))
    assert np.all(free["distance"] < 1e-4)
    assert np.all(free["angle"] == 0)
    turned = answer(given[0], -3 * given[1])  # the same orientation, of any length and sign
    np.testing.assert_allclose(turned["joints"], answer(*given)["joints"], atol=1e-3)


def test_a_target_that_is_no_number_spoils_no_other(answers: Callable[[str, str], Answer]) -> None:
    body, given = learned("planar"), asked("planar", learned("planar").postures(3, 6))[0]
    answer = answers("planar", ".onnx")
    spoilt = given.copy()
    spoilt[1] = np.nan
    found = answer(spoilt)
    assert np.isnan(found["distance"][1])
    assert np.all((body.lower <= found["joints"]) & (found["joints"] <= body.upper))
    np.testing.assert_array_equal(found["joints"][[0, 2]], answer(given)["joints"][[0, 2]])


def test_the_file_says_what_it_is(folder: Path, answers: Callable[[str, str], Answer]) -> None:
    for ending in FORMATS:
        answers("soft", ending)
    session = onnxruntime.InferenceSession(folder / "soft.onnx", providers=["CPUExecutionProvider"])
    facts = {key: json.loads(value) for key, value in session.get_modelmeta().custom_metadata_map.items()}
    skill, exported = learned("soft").skill, jax.export.deserialize(bytearray((folder / "soft.jax").read_bytes()))
    assert facts == json.loads(exported.fun_name)
    assert facts["joints"] == list(skill.joints)
    assert facts["lower"] == skill.lower.tolist()
    assert 0 < facts["expected_error_m"] < facts["expected_error_90_m"] < 0.01
    assert set(exported.platforms) == {"cpu", "cuda", "tpu"}
    assert [value.shape for value in session.get_inputs()] == [["batch", 3]]
    assert [value.shape for value in session.get_outputs()] == [["batch", 6], ["batch"]]


def random_models() -> dict[str, Model]:
    rng = np.random.default_rng(2)
    normal = lambda *shape: rng.normal(size=shape)  # noqa: E731
    curved = lambda order: SOFT._replace(order=order)  # noqa: E731
    soft = {
        order: Curvature(curved(order), 0.3 * normal(n := places(curved(order)).total), np.eye(n)) for order in (1, 3)
    }
    rest = Rest(3, SOFT.middle, SOFT.half, 0.1 * normal(84, 3), np.eye(84))
    turns = np.array([True, False, True, True])
    doubt = Doubt(Embedding(turns, np.ones(4)), normal(5, 7), np.eye(5), np.eye(3), (0.0, 1.0))
    network = tuple(
        Layer(*((0.2 * normal(*shape)).astype(np.float32) for shape in ((wide, 8), (wide, 8), (8,), (8,))))
        for wide in (7, 8)
    )
    out = normal(8, 3).astype(np.float32)
    narrow = (network[0]._replace(first=network[0].first[:4], second=network[0].second[:4]),)
    return {
        "straight": Curvature(SOFT, 1e-6 * normal(n := places(SOFT).total), np.eye(n)),
        "arcs": soft[1],
        "bent actuators": soft[3],
        "mended": Mended(soft[1], rest, 0.0),
        "arcs that do": Mended(soft[1], None, 1e-6),
        "crippled": Crippled(soft[1], SOFT.middle, SOFT.middle + 0.01, rng.random(6), np.eye(12)),
        "products": Multilinear(~turns, normal(4), normal(54, 3), np.eye(54), np.eye(3)),
        "network": Network(turns, normal(4), 1 + rng.random(4), network, out, normal(3), 0.5, doubt),
        "angles only": Network(np.ones(2, bool), normal(2), np.ones(2), narrow, out, normal(3), 0.5, doubt),
    }  # fmt: skip


@pytest.mark.parametrize("name", random_models())
def test_every_model_puts_its_tip_where_toddle_does(name: str) -> None:
    model = random_models()[name]
    joints = 6 if isinstance(model, Curvature | Mended | Crippled) else 2 if name == "angles only" else 4
    q = np.random.default_rng(1).uniform(0.15, 0.25, (20, joints))
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        tip = forward_of(model)(JaxOps(), jax.numpy.asarray(q[None], "float32"))[0]
    np.testing.assert_allclose(tip, model.forward(q), rtol=1e-4, atol=1e-4 if "products" in name else 3e-6)


@given(st.floats(-1e4, 1e4), st.floats(0, 1e3))
def test_limits_are_rounded_inwards(lower: float, span: float) -> None:
    low, high = np.array([lower]), np.array([lower + span])
    inner = _inward(low, np.inf), _inward(high, -np.inf)
    assert inner[0] >= low
    assert inner[1] <= high
    assert np.all(inner[0].astype(np.float32) == inner[0])
    np.testing.assert_allclose(inner, (low, high), rtol=1e-6, atol=1e-40)


@pytest.mark.parametrize("name", ["skill.txt", "skill", "skill.onnx.gz"])
def test_an_ending_that_is_no_format_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"end it in \.onnx or \.jax"):
        export(learned("planar").skill, tmp_path / name)
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_folder_that_is_not_there_is_refused(ending: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="folder isn't there"):
        export(learned("planar").skill, tmp_path / "none" / f"skill{ending}")


def test_a_model_that_has_no_graph_is_refused(tmp_path: Path) -> None:
    skill, ones = learned("planar").skill, np.ones(3)
    embedding = Embedding(np.ones(3, bool), ones)
    doubt = Doubt(embedding, np.ones((1, 6)), np.eye(1), np.eye(2), (0.0, 1.0))
    other = replace(skill.fit, model=Kernel(embedding, np.ones((1, 6)), np.ones((1, 2)), np.ones(2), doubt))
    with pytest.raises(BadInput, match="Kernel can't be exported"):
        export(replace(skill, fit=other), tmp_path / "skill.onnx")
    assert not os.listdir(tmp_path)


def test_onnx_is_asked_for_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(MissingExtra, match=r"toddle\[export\]"):
        export(learned("planar").skill, tmp_path / "skill.onnx")
    assert not os.listdir(tmp_path)
