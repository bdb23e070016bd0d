"""Networks on disk: what was saved comes back bit for bit, what was touched is refused, exports answer alike."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import export
from small_networks import DOCUMENT, LIGHT, NETWORKS, episodes

from toddle.failures import BadInput
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.training import begin, step
from toddle.outside.navigation.cloning_files import (
    Saved,
    load_cloned,
    load_run,
    save_cloned,
    save_run,
)
from toddle.outside.navigation.export_cloned import export_cloned
from toddle.outside.navigation.room_policies import is_cloned

Answers = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]


def _policy(config: CloningConfig = LIGHT) -> Cloned:
    training = begin(config, episodes(), 0)
    net = training.learner.network
    large = jax.random.normal(jax.random.key(1), net.steer.shape, jnp.float32)
    net = jax.tree.map(lambda leaf: large if leaf is net.steer else leaf, net)
    return Cloned(net, training.scale, config, {"dataset": "drives"}, {"loss": 1.5})


def _looks(policy: Cloned, count: int) -> dict[str, np.ndarray]:
    draw = np.random.default_rng(3)
    depth = np.where(draw.random((count, 60, 80)) < 0.2, 0.0, draw.uniform(0.3, 6.0, (count, 60, 80)))
    memory = 0.5 * draw.normal(size=(count, *policy.start().shape))
    if policy.config.network == "document":
        memory[..., -1] = np.arange(policy.config.steps) >= 2  # three looks so far
    return {
        "picture": draw.integers(0, 256, (count, 60, 80, 3)).astype(np.uint8),
        "depth": depth.astype(np.float32),
        "velocity": draw.uniform(-0.2, 0.2, (count, 2)).astype(np.float32),
        "memory": memory.astype(np.float32),
    }


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS.keys())
def test_a_policy_comes_back_bit_for_bit(config: CloningConfig, tmp_path: Path) -> None:
    policy = _policy(config)
    again = load_cloned(save_cloned(policy, tmp_path / "a"))
    for one, other in zip(jax.tree.leaves(policy.network), jax.tree.leaves(again.network), strict=True):
        assert np.array_equal(one, other)
    assert again.config == policy.config
    assert np.array_equal(np.stack(again.scale), np.stack(policy.scale))
    assert (again.source, again.figures) == (policy.source, policy.figures)
    assert is_cloned(tmp_path / "a")
    assert not is_cloned(tmp_path)


def test_what_was_touched_is_refused(tmp_path: Path) -> None:
    save_cloned(_policy(), tmp_path)
    content = (tmp_path / "policy.safetensors").read_bytes()
    (tmp_path / "policy.safetensors").write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(BadInput, match="altered"):
        load_cloned(tmp_path)
    with pytest.raises(BadInput, match="no cloned here"):
        load_cloned(tmp_path / "nowhere")


def test_a_broken_policy_is_not_saved(tmp_path: Path) -> None:
    policy = _policy()
    broken = jax.tree.map(lambda leaf: leaf * np.float32(np.nan), policy.network)
    with pytest.raises(BadInput, match="not finite"):
        save_cloned(Cloned(broken, policy.scale, policy.config), tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(("network", "ending"), [("light", ".onnx"), ("light", ".jax"), ("document", ".onnx")])
def test_exports_answer_as_the_policy_does(network: str, ending: str, tmp_path: Path) -> None:
    """For one look and for three, the document's window partly empty."""
    config = NETWORKS[network]
    policy, path = _policy(config), tmp_path / f"policy{ending}"
    export_cloned(policy, path)
    answered = _onnx(path) if ending == ".onnx" else _jax(path)
    for count in (1, 3):
        given = _looks(policy, count)
        said, memory = jax.vmap(policy)(*map(jnp.asarray, given.values()))
        found = answered(given)
        np.testing.assert_allclose(found["command"], said, atol=2e-5)
        np.testing.assert_allclose(found["next_memory"], memory, atol=2e-5)


@pytest.mark.parametrize("part", ["memory", "depth"])
def test_exports_leave_out_what_the_policy_leaves_out(part: str, tmp_path: Path) -> None:
    for config in (LIGHT, DOCUMENT):
        policy, path = _policy(CloningConfig(**{**config.__dict__, part: False})), tmp_path / "policy.onnx"
        export_cloned(policy, path)
        given = _looks(policy, 2)
        said, _ = jax.vmap(policy)(*map(jnp.asarray, given.values()))
        np.testing.assert_allclose(_onnx(path)(given)["command"], said, atol=2e-5)


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no format"):
        export_cloned(_policy(), tmp_path / "policy.pt")


def test_a_run_comes_back_bit_for_bit_and_the_newest_whole_one(tmp_path: Path) -> None:
    training, given = begin(LIGHT, episodes(), 0), episodes()
    for count in (1, 2):
        training, _ = step(training, LIGHT, given, 1e-3)
        facts = {"done": count}
        save_run(tmp_path, Saved(LIGHT, training, training, {"total": np.arange(3.0)}, facts), count)
    saved, count = load_run(tmp_path)
    assert count == 2
    assert saved.facts["done"] == 2
    one, other = (step(start, LIGHT, given, 1e-3) for start in (training, saved.training))
    for mine, yours in zip(
        jax.tree.leaves(one[0].learner.network), jax.tree.leaves(other[0].learner.network), strict=True
    ):
        assert np.array_equal(mine, yours)
    assert float(one[1].total) == float(other[1].total)
    (tmp_path / "checkpoint-a.safetensors").write_bytes(b"cut off")
    assert load_run(tmp_path)[1] == 1


def _onnx(path: Path) -> Answers:
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    assert json.loads(session.get_modelmeta().custom_metadata_map["period_s"]) == 0.2
    names = ["command", "next_memory"]
    return lambda given: dict(zip(names, [np.asarray(one) for one in session.run(names, given)], strict=True))


def _jax(path: Path) -> Answers:
    exported = export.deserialize(bytearray(path.read_bytes()))
    assert json.loads(exported.fun_name)["period_s"] == 0.2

    def answered(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        found: dict[str, jax.Array] = exported.call(*map(jnp.asarray, given.values()))  # pyright: ignore
        return {name: np.asarray(value) for name, value in found.items()}

    return answered
