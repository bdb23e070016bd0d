"""A skill as a file that answers without toddle: an ONNX graph, or StableHLO for `jax.export`.

The file holds the whole way from targets to joint values: the learned body, the stored postures, the solver, the joint
limits. Inputs are ``target`` (batch, space) [m] in the base frame and, where the skill knows orientations,
``quaternion`` (batch, 4) as w, x, y, z, all zero where any orientation will do. Outputs are ``joints`` (batch, joints)
[rad or m] within the limits, ``distance`` (batch) [m] from the target to where the learned body puts the tip, and
``angle`` (batch) [rad] where there is a quaternion. All of them are float32, for any batch.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from toddle.outside.export_file import write_export
from toddle.outside.export_models import model_problem
from toddle.outside.export_rigid import rigid_problem
from toddle.outside.export_solve import Problem, answered
from toddle.outside.versions import versions
from toddle.reach.body_skill import BodySkill
from toddle.reach.model.rigid import Rigid

_SHOWN = 200  # movements that the error to expect is told from


def export(skill: BodySkill, path: Path) -> None:
    """Write a skill as a file that answers without toddle; its ending says in which format.

    Args:
        skill: what was learned.
        path: ``.onnx`` for ONNX, ``.jax`` for `jax.export`.

    Raises:
        BadInput: the ending names no format, the folder isn't there, or the skill's model can't be exported.
        MissingExtra: ONNX isn't installed.
    """

    def onnx() -> bytes:
        from toddle.outside.export_onnx import onnx_bytes

        return _content(skill, onnx_bytes)

    def jax() -> bytes:
        from toddle.outside.export_jax import jax_bytes

        return _content(skill, jax_bytes)

    write_export(path, onnx, jax)


def _content(skill: BodySkill, written: Callable[..., bytes]) -> bytes:
    problem, inputs = problem_of(skill), {"target": skill.fit.model.space}
    if skill.turned:
        inputs["quaternion"] = 4
    return written(lambda ops, *given: answered(ops, problem, *given), inputs, about(skill))


def problem_of(skill: BodySkill) -> Problem:
    """What is computed in the file.

    Raises:
        BadInput: the skill's model can't be exported.
    """
    lower, upper = _inward(skill.lower, np.inf), _inward(skill.upper, -np.inf)
    if isinstance(skill.fit.model, Rigid):
        return rigid_problem(skill.fit.model, lower, upper, turned=skill.turned)
    return model_problem(skill.fit.model, lower, upper, skill.experience)


def about(skill: BodySkill) -> dict[str, object]:
    """What a user of the file should know."""
    mean, most = skill.expectation.at(skill.experience.q[:_SHOWN])
    return {
        "format": "toddle exported skill 1",
        "toddle": versions()["toddle"],
        "robot": skill.source.spec,
        "model": skill.fit.kind,
        "joints": list(skill.joints),
        "lower": skill.lower.tolist(),
        "upper": skill.upper.tolist(),
        "units": "joints: rad, or m where they slide; target and distance: m; quaternion: w x y z; angle: rad",
        "expected_error_m": float(np.mean(mean)),
        "expected_error_90_m": float(np.mean(most)),
    }


def _inward(limit: Float[np.ndarray, " joints"], towards: float) -> Float[np.ndarray, " joints"]:
    """Limits that float32 holds, none beyond the true ones."""
    rounded = limit.astype(np.float32)
    beyond = rounded < limit if towards > 0 else rounded > limit
    return np.where(beyond, np.nextafter(rounded, np.float32(towards)), rounded).astype(float)
