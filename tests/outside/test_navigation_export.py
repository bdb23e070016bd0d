"""Exported policies answer without toddle, and as toddle does."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import onnxruntime
import pytest
from jax import export

from toddle.failures import BadInput
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import actor_critic
from toddle.navigate.task import Actions, Continuous, Discrete
from toddle.outside.navigation.export_policy import export_policy

CASES: dict[str, tuple[dict[str, Any], Actions]] = {
    "clip": ({"bound": "clip"}, Continuous(2)),
    "tanh": ({"bound": "tanh", "activation": "relu"}, Continuous(3)),
    "mean": ({"bound": "mean", "normalise_observations": False}, Continuous(1)),
    "discrete": ({"hidden": (6,)}, Discrete(4)),
    "memory": ({"memory": 3}, Continuous(2)),
    "discrete memory": ({"memory": 2, "activation": "relu"}, Discrete(3)),
}
NUMBERS = 5


def policy(case: str) -> Policy:
    """With weights large enough that every bound is met."""
    changes, actions = CASES[case]
    config = PpoConfig(**{"hidden": (7, 4), **changes})
    network = jax.eval_shape(lambda: actor_critic(config, NUMBERS, actions, jax.random.key(0)))
    rng = np.random.default_rng(2)
    network = jax.tree.map(lambda part: jnp.asarray(rng.normal(0, 1.2, part.shape), jnp.float32), network)
    moments = Moments(
        jnp.float32(9.0), jnp.array([0.5, -1, 0, 2, 30], jnp.float32), jnp.array([1, 4, 0.1, 2, 0], jnp.float32)
    )
    return Policy(network, moments, config, NUMBERS, actions, {"task": "odd"}, {"return_mean": 2.5})


def by_hand(policy: Policy, rows: int) -> list[dict[str, np.ndarray]]:
    """Observations, and what toddle does of them, over three steps of memory."""
    rng = np.random.default_rng(4)
    memory = np.zeros((rows, 2, policy.config.memory), np.float32)
    course = []
    for _ in range(3):
        seen = rng.normal(np.array([0, 0, 0, 0, 30]), 3, (rows, NUMBERS)).astype(np.float32)
        answers = [policy(jnp.asarray(one), jnp.asarray(known)) for one, known in zip(seen, memory, strict=True)]
        action, after = (np.stack([np.asarray(answer[k]) for answer in answers]) for k in (0, 1))
        course.append({"observation": seen, "memory": memory, "action": action, "next_memory": after})
        memory = after
    return course


@pytest.mark.parametrize("case", CASES)
def test_both_files_answer_as_the_policy_does(tmp_path: Path, case: str) -> None:
    made = policy(case)
    for ending in ("onnx", "jax"):
        export_policy(made, tmp_path / f"p.{ending}")
    session = onnxruntime.InferenceSession(tmp_path / "p.onnx")
    exported = export.deserialize(bytearray((tmp_path / "p.jax").read_bytes()))
    given = [part.name for part in session.get_inputs()]
    assert given == (["observation", "memory"] if made.config.memory else ["observation"])
    for rows in (1, 6):
        for step in by_hand(made, rows):
            inputs = {name: step[name] for name in given}
            names = [part.name for part in session.get_outputs()]
            by_onnx = dict(zip(names, session.run(names, inputs), strict=True))
            by_jax: dict[str, Any] = dict(exported.call(*inputs.values()))
            assert set(by_onnx) == set(by_jax) == {"action", *(["next_memory"] if made.config.memory else [])}
            for found in (by_onnx, by_jax):
                for name, value in found.items():
                    assert np.asarray(value).dtype == step[name].dtype
                    np.testing.assert_allclose(np.asarray(value), step[name], rtol=0, atol=1e-5)
            if isinstance(made.actions, Continuous):
                assert np.abs(np.asarray(by_onnx["action"])).max() <= 1.0


def test_the_cases_meet_the_bounds() -> None:
    """Else the test above would not see them."""
    step = by_hand(policy("clip"), 6)[0]
    assert (np.abs(step["action"]) == 1.0).any()
    assert (np.abs(step["action"]) < 1.0).any()
    assert len(set(by_hand(policy("discrete"), 6)[0]["action"].tolist())) > 1


def test_the_files_say_what_they_are(tmp_path: Path) -> None:
    for ending in ("onnx", "jax"):
        export_policy(policy("memory"), tmp_path / f"p.{ending}")
    session = onnxruntime.InferenceSession(tmp_path / "p.onnx")
    by_onnx = {key: json.loads(value) for key, value in session.get_modelmeta().custom_metadata_map.items()}
    by_jax = json.loads(export.deserialize(bytearray((tmp_path / "p.jax").read_bytes())).fun_name)
    assert by_onnx == by_jax
    assert (by_jax["actions"], by_jax["memory"], by_jax["source"]) == ({"continuous": 2}, 3, {"task": "odd"})


@pytest.mark.parametrize(("name", "why"), [("p.pt", "is no format"), ("p", "no ending"), ("no/p.jax", "isn't there")])
def test_what_can_not_be_written_is_refused(tmp_path: Path, name: str, why: str) -> None:
    with pytest.raises(BadInput, match=why):
        export_policy(policy("clip"), tmp_path / name)
    assert not list(tmp_path.iterdir())
