"""Policies and interrupted runs on disk: bit for bit, whole or refused, and safe from whatever cuts a writer off."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from toddle.failures import BadInput
from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import Training, init
from toddle.navigate.task import Continuous, Discrete
from toddle.navigate.tasks.point import PointTask
from toddle.outside import files
from toddle.outside.navigation.policy_files import load_policy, save_policy
from toddle.outside.navigation.training_files import load_training, read_training, save_training

TASK = PointTask(longest=40)
CONFIG = PpoConfig(
    steps=640, actors=4, horizon=16, minibatch=32, epochs=2, hidden=(5,), memory=3, sequence=8, c2=0.01
)  # fmt: skip


@functools.cache
def trained(updates: int) -> Training:
    """A run with a memory, as it might be after so many updates."""
    return begun(jax.random.key(updates))._replace(updates=jnp.int32(updates))


begun = jax.jit(functools.partial(init, TASK, CONFIG))


@functools.cache
def policy() -> Policy:
    """A policy that has learned a little."""
    return policy_of(trained(2), CONFIG, TASK.actions, {"env": "point"}, {"return_mean": -0.1})


def shapes() -> Training:
    """Of a run, without values."""
    return jax.eval_shape(begun, jax.random.key(0))


def bits(tree: Any) -> list[bytes]:
    """Of all leaves."""
    plain = [
        jax.random.key_data(x) if jnp.issubdtype(x.dtype, jax.dtypes.prng_key) else x for x in jax.tree.leaves(tree)
    ]
    return [np.asarray(x).tobytes() for x in plain]


def test_a_policy_comes_back_bit_for_bit(tmp_path: Path) -> None:
    save_policy(policy(), tmp_path / "here")
    found = load_policy(tmp_path / "here")
    assert bits((found.network, found.moments)) == bits((policy().network, policy().moments))
    assert jax.tree.structure(found.network) == jax.tree.structure(policy().network)
    assert (found.config, found.actions, found.observations) == (CONFIG, Continuous(2), 4)
    assert (found.source, found.figures) == ({"env": "point"}, {"return_mean": -0.1})
    seen = jnp.array([0.3, -0.2, 4.0, -1.0])
    assert bits(found(seen, found.start())) == bits(policy()(seen, policy().start()))


@pytest.mark.parametrize("actions", [Continuous(3), Discrete(7)])
@pytest.mark.parametrize("bound", ["clip", "tanh", "mean"])
def test_any_actions_come_back(tmp_path: Path, actions: Any, bound: Any) -> None:
    config = PpoConfig(hidden=(3, 2), bound=bound, activation="relu")
    task = _Spaces(6, actions)
    made = _untrained(config, task)
    save_policy(made, tmp_path)
    found = load_policy(tmp_path)
    assert (found.actions, found.config) == (actions, config)
    assert bits(found.network) == bits(made.network)


class _Spaces(NamedTuple):
    observations: int
    actions: Any


def _untrained(config: PpoConfig, task: _Spaces) -> Policy:
    from toddle.navigate.ppo.moments import unseen
    from toddle.navigate.ppo.network import actor_critic

    network = jax.eval_shape(lambda: actor_critic(config, task.observations, task.actions, jax.random.key(1)))
    rng = np.random.default_rng(1)
    network = jax.tree.map(lambda part: jnp.asarray(rng.normal(size=part.shape), jnp.float32), network)
    return Policy(network, unseen(task.observations), config, task.observations, task.actions)


@pytest.mark.parametrize("name", ["policy.json", "policy.safetensors"])
def test_every_altered_byte_is_refused(tmp_path: Path, name: str) -> None:
    save_policy(policy(), tmp_path)
    content = (tmp_path / name).read_bytes()
    for place in np.linspace(0, len(content) - 1, 25, dtype=int).tolist():
        altered = bytearray(content)
        altered[place] ^= 1
        (tmp_path / name).write_bytes(bytes(altered))
        with pytest.raises(BadInput) as refusal:
            load_policy(tmp_path)
        assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", ["policy.json", "policy.safetensors"])
def test_truncated_and_missing_files_are_refused(tmp_path: Path, name: str) -> None:
    save_policy(policy(), tmp_path)
    content = (tmp_path / name).read_bytes()
    for length in (0, 1, len(content) // 2, len(content) - 1):
        (tmp_path / name).write_bytes(content[:length])
        with pytest.raises(BadInput):
            load_policy(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(BadInput, match="there is no policy here"):
        load_policy(tmp_path)


def rewritten(folder: Path, change: Any) -> None:
    """A policy's files by a forger who knows the digests."""
    save_policy(policy(), folder)
    facts, tensors = files.read_record(folder, "policy", "policy")
    change(facts, tensors)
    files.write_record(folder, "policy", "policy", facts, tensors)


def _bad_weight(facts: dict, tensors: dict, value: float = np.nan) -> None:
    weight = next(name for name in sorted(tensors) if "actor.weights" in name)
    tensors[weight] = np.full_like(tensors[weight], value)


FORGERIES = {
    "not a number": _bad_weight,
    "endless": lambda facts, tensors: _bad_weight(facts, tensors, np.inf),
    "negative variance": lambda facts, tensors: tensors.update({"moments.variance": np.full(4, -1, np.float32)}),
    "one more": lambda facts, tensors: tensors.update(more=np.zeros(2, np.float32)),
    "one less": lambda facts, tensors: tensors.pop("moments.mean"),
    "double": lambda facts, tensors: tensors.update({"moments.mean": np.zeros(4)}),
    "shape": lambda facts, tensors: tensors.update({"moments.mean": np.zeros(5, np.float32)}),
    "no actions": lambda facts, tensors: facts.update(actions={}),
    "other actions": lambda facts, tensors: facts.update(actions={"discrete": 2}),
    "odd actions": lambda facts, tensors: facts.update(actions={"continuous": "2"}),
    "unknown field": lambda facts, tensors: facts["config"].update(colour="red"),
    "unknown bound": lambda facts, tensors: facts["config"].update(bound="tight"),
    "config of texts": lambda facts, tensors: facts["config"].update(hidden=["5"]),
    "config out of range": lambda facts, tensors: facts["config"].update(gamma=2.0),
    "enormous": lambda facts, tensors: facts.update(observations=2**70),
    "true": lambda facts, tensors: facts.update(observations=True),
    "no figures": lambda facts, tensors: facts.pop("figures"),
    "figures": lambda facts, tensors: facts.update(figures=3),
}


@pytest.mark.parametrize("what", FORGERIES)
def test_foreign_contents_are_refused(tmp_path: Path, what: str) -> None:
    rewritten(tmp_path, FORGERIES[what])
    with pytest.raises(BadInput, match="it is not a policy of this version"):
        load_policy(tmp_path)


def test_a_broken_policy_is_not_written(tmp_path: Path) -> None:
    sound = policy()
    broken = dataclasses.replace(sound, moments=sound.moments._replace(mean=sound.moments.mean * jnp.nan))
    with pytest.raises(BadInput, match="not finite"):
        save_policy(broken, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def saved(folder: Path, updates: int) -> Training:
    """A run of so many updates, saved."""
    training, steps = trained(updates), CONFIG.batch * np.arange(1, 3)
    history = {"reward": np.array([0.5, np.nan], np.float32), "steps": steps}
    save_training(folder, CONFIG, training, history, {"env": "point"}, figures={"seed": 5})
    return training


def test_a_run_comes_back_bit_for_bit(tmp_path: Path) -> None:
    training = saved(tmp_path, 2)
    assert read_training(tmp_path) == (CONFIG, {"env": "point"})
    found = load_training(tmp_path, shapes())
    assert bits(found.training) == bits(training)
    assert (found.config, found.source, found.figures, found.passed_over) == (
        CONFIG,
        {"env": "point"},
        {"seed": 5},
        None,
    )
    assert found.history["steps"].tolist() == [CONFIG.batch, 2 * CONFIG.batch]
    assert found.best is None
    assert np.isnan(found.history["reward"][1])


def test_what_did_best_comes_back_too(tmp_path: Path) -> None:
    training, early = trained(2), trained(4)
    save_training(tmp_path, CONFIG, training, {}, {}, best=(early.network, early.observations))
    assert bits(load_training(tmp_path, shapes()).best) == bits((early.network, early.observations))


def test_a_task_may_hold_any_arrays(tmp_path: Path) -> None:
    """On the host in double, keys, whole numbers, truths, nothing, nested."""

    class Odd(NamedTuple):
        host: np.ndarray
        keys: Array
        nested: dict
        none: None = None

    state = Odd(
        np.linspace(0, 1, 5), jax.random.split(jax.random.key(3), 4),
        {"a": (jnp.arange(3), jnp.array([True, False])), "b": [np.zeros((0, 2), np.int64), jnp.uint8(7)]},
    )  # fmt: skip
    training = trained(2)
    training = training._replace(actors=training.actors._replace(state=state))
    save_training(tmp_path, CONFIG, training, {}, {})
    found = load_training(tmp_path, training).training
    assert bits(found) == bits(training)
    assert jax.tree.structure(found) == jax.tree.structure(training)
    assert isinstance(found.actors.state.host, np.ndarray)
    assert found.actors.state.host.dtype == np.float64
    assert jax.random.key_impl(found.actors.state.keys) == jax.random.key_impl(state.keys)


def test_another_task_is_refused(tmp_path: Path) -> None:
    saved(tmp_path, 2)
    other = dataclasses.replace(CONFIG, actors=8)
    template = jax.eval_shape(lambda: init(TASK, other, jax.random.key(0)))
    with pytest.raises(BadInput, match="does not fit this task"):
        load_training(tmp_path, template)


class Killed(BaseException):
    """The process ends here."""


@pytest.mark.parametrize("writes", range(4))
def test_a_crash_in_between_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writes: int) -> None:
    """Killed before any of the files of a save is in place, the run before is still there, and saving works again."""
    before = saved(tmp_path, 2)
    left = iter([None] * writes)
    put = os.replace

    def dying(part: Any, path: Any) -> None:
        if next(left, Killed) is Killed:
            raise Killed
        put(part, path)

    monkeypatch.setattr(os, "replace", dying)
    if writes < 3:
        with pytest.raises(Killed):
            saved(tmp_path, 4)
    else:
        saved(tmp_path, 4)
    monkeypatch.setattr(os, "replace", put)
    found = load_training(tmp_path, shapes())
    assert bits(found.training) == bits(before if writes < 3 else trained(4))
    assert found.passed_over is None
    saved(tmp_path, 4)
    assert bits(load_training(tmp_path, shapes()).training) == bits(trained(4))
    assert len(list((tmp_path / "checkpoints").iterdir())) == 2


def test_the_one_before_stands_in_for_a_damaged_one(tmp_path: Path) -> None:
    before = saved(tmp_path, 2)
    saved(tmp_path, 4)
    newest = max((tmp_path / "checkpoints").iterdir()) / "training.safetensors"
    newest.write_bytes(newest.read_bytes()[:-1])
    found = load_training(tmp_path, shapes())
    assert bits(found.training) == bits(before)
    assert str(newest) in (found.passed_over or "")
    older = min((tmp_path / "checkpoints").iterdir()) / "training.json"
    older.write_text("{}")
    with pytest.raises(BadInput, match="cut short"):
        load_training(tmp_path, shapes())


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"format": "toddle checkpoints", "version": 2, "checkpoints": ["000001"]}',
     '{"format": "toddle checkpoints", "version": 1, "checkpoints": ["../../x"]}',
     '{"format": "toddle checkpoints", "version": 1, "checkpoints": [1]}',
     '{"format": "toddle checkpoints", "version": 1, "checkpoints": []}', "[" * 9000],
)  # fmt: skip
def test_a_foreign_list_of_checkpoints_is_refused(tmp_path: Path, content: str) -> None:
    saved(tmp_path, 2)
    (tmp_path / "checkpoint.json").write_text(content)
    with pytest.raises(BadInput, match=r"checkpoint\.json"):
        read_training(tmp_path)
    with pytest.raises(BadInput, match=r"checkpoint\.json"):  # nor is it written over
        saved(tmp_path, 2)


def test_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no run here"):
        read_training(tmp_path)
    with pytest.raises(BadInput):
        read_training(tmp_path / "nowhere")


def test_only_two_are_kept_and_numbers_go_up(tmp_path: Path) -> None:
    for _ in range(3):
        saved(tmp_path, 2)
    assert sorted(path.name for path in (tmp_path / "checkpoints").iterdir()) == ["000002", "000003"]
    assert json.loads((tmp_path / "checkpoint.json").read_text())["checkpoints"] == ["000003", "000002"]
