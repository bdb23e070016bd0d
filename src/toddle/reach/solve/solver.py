"""What a solver is, and the one that suits a model: native for rigid arms, batched NumPy for anything else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.model import Model
from toddle.reach.model.rigid import Rigid
from toddle.reach.solve.answers import Answers
from toddle.signals import Experience

Choice = Literal["first", "nearest", "central"]
_MANY = 24  # starts where a target seems out of reach


@runtime_checkable
class Solver(Protocol):
    """Joint values within the limits that bring a model's tip to targets."""

    def solve(
        self,
        targets: Float[np.ndarray, "batch space"],
        turns: Float[np.ndarray, "batch 3 3"] | None = None,
        *,
        near: Float[np.ndarray, "*batch joints"] | None = None,
        choice: Choice = "first",
    ) -> Answers:
        """Answers for a batch of targets [m].

        Args:
            targets: where the tip should go [m].
            turns: how it should be turned, as rotations from the tip's frame to the base's; None: as it comes.
            near: the present posture, one for all or one each [rad or m].
            choice: of several postures: the first found, the nearest to ``near``, or the most central one.
        """
        ...

    def nearest(
        self, target: Float[np.ndarray, " space"], turn: Float[np.ndarray, "3 3"] | None = None
    ) -> tuple[Float[np.ndarray, " joints"], float, float]:
        """The posture that comes nearest to a target, and how far it stays from it [m], [rad]."""
        ...

    def distinct(
        self,
        target: Float[np.ndarray, " space"],
        turn: Float[np.ndarray, "3 3"] | None = None,
        count: int = 4,
        *,
        near: Float[np.ndarray, " joints"] | None = None,
    ) -> Float[np.ndarray, "found joints"]:
        """Up to so many clearly different postures that reach a target, the nearest to ``near`` first."""
        ...


@dataclass(frozen=True)
class ModelSolver:
    """A `Solver` for any model.

    Attributes:
        model: the learned body.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        known: movements, whose postures are where it starts from.
    """

    model: Model
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    known: Experience

    def solve(
        self,
        targets: Float[np.ndarray, "batch space"],
        turns: Float[np.ndarray, "batch 3 3"] | None = None,
        *,
        near: Float[np.ndarray, "*batch joints"] | None = None,
        choice: Choice = "first",
    ) -> Answers:
        """Answers for a batch of targets [m]."""
        if turns is not None:
            raise BadInput("this skill knows no orientation", where="orientation", remedy="learn again with --pose")
        return self._from(targets, near=near if choice == "nearest" else None, central=choice == "central")

    def nearest(
        self, target: Float[np.ndarray, " space"], turn: Float[np.ndarray, "3 3"] | None = None
    ) -> tuple[Float[np.ndarray, " joints"], float, float]:
        """The posture that comes nearest to a target, and how far it stays from it [m], [rad]."""
        answer = self._from(target[None], starts=_MANY)
        return answer.q[0], float(answer.distance[0]), 0.0

    def distinct(
        self,
        target: Float[np.ndarray, " space"],
        turn: Float[np.ndarray, "3 3"] | None = None,
        count: int = 4,
        *,
        near: Float[np.ndarray, " joints"] | None = None,
    ) -> Float[np.ndarray, "found joints"]:
        """Up to so many clearly different postures that reach a target, the nearest to ``near`` first."""
        rng = np.random.default_rng(0)
        starts = rng.uniform(self.lower, self.upper, (8 * count, len(self.lower)))
        answers = self._from(np.repeat(target[None], len(starts), 0), near=starts, starts=1)
        return _apart(answers.q[answers.solved], near, self.upper - self.lower, count)

    def _from(self, targets: np.ndarray, **how: Any) -> Answers:
        from toddle.reach.solve.gauss_newton import solve_model

        return solve_model(self.model, targets, self.lower, self.upper, memory=(self.known.q, self.known.x), **how)


def solver_of(
    model: Model, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], known: Experience
) -> Solver:
    """The solver that suits a model.

    Args:
        model: the learned body.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        known: movements that were made.
    """
    if isinstance(model, Rigid):
        from toddle.reach.solve.damped import damped_solver

        return damped_solver(model.linkage, lower, upper, coordinates=model.coordinates)
    return ModelSolver(model, lower, upper, known)


def _apart(
    postures: Float[np.ndarray, "found joints"],
    near: Float[np.ndarray, " joints"] | None,
    span: Float[np.ndarray, " joints"],
    count: int,
) -> Float[np.ndarray, "chosen joints"]:
    """Postures that differ clearly from each other, the nearest to the present one first."""
    order = np.argsort(np.linalg.norm((postures - near) / span, axis=1)) if near is not None else range(len(postures))
    chosen: list[np.ndarray] = []
    for q in postures[order]:
        if all(np.max(np.abs(q - other) / span) > 0.1 for other in chosen):
            chosen.append(q)
    return np.array(chosen[:count]).reshape(-1, len(span))
