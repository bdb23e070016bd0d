"""Two answers to "where is the tip?", to be compared: ours, and MuJoCo's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from toddle.robots.chain import Chain

Pose = Callable[[mujoco.MjModel, str, str, Mapping[str, float]], np.ndarray]
Answer = Callable[[Chain, np.ndarray], tuple[np.ndarray, np.ndarray]]


def _frame(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> np.ndarray:
    frame = np.eye(4)
    place = data.body(name) if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0 else data.site(name)
    frame[:3, :3], frame[:3, 3] = place.xmat.reshape(3, 3), place.xpos
    return frame


def _pose(model: mujoco.MjModel, base: str, tip: str, values: Mapping[str, float]) -> np.ndarray:
    """The transform from base to tip (bodies or sites) when the joints have these values, others qpos0."""
    data = mujoco.MjData(model)
    for name, value in values.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    return np.linalg.inv(_frame(model, data, base)) @ _frame(model, data, tip)


@pytest.fixture(scope="session")
def mujoco_pose() -> Pose:
    """Base-to-tip transforms by MuJoCo: model, base, tip, joint values -> 4 x 4."""
    return _pose


@eqx.filter_jit
def _answers(chain: Chain, q: jax.Array) -> tuple[jax.Array, jax.Array]:
    return jax.vmap(chain.forward)(q), jax.vmap(chain.pose)(q)


def _answer(chain: Chain, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and poses; without names, so that robots of one shape share one compilation."""
    nameless = replace(chain, name="", joints=tuple(str(i) for i in range(len(chain.joints))))
    x, pose = _answers(nameless, jnp.asarray(q, jnp.float32))
    return np.asarray(x), np.asarray(pose)


@pytest.fixture(scope="session")
def answer() -> Answer:
    """Positions and base-to-tip transforms by the chain itself, for rows of joint values."""
    return _answer
