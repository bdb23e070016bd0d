"""Inverse kinematics of a rigid arm, learned or known, in microseconds: position or full pose, inside the limits.

Damped least squares from the stored postures whose tip is nearest to the target, the next one only where a start
fails; `toddle.reach.solve.damped_kernels` has the equations. What isn't reached is brought to the least-squares minimum
over the limits (an angle counts as 0.3 m a radian), so that an answer to a target out of reach is the nearest that the
arm comes. Redundancy is a choice: the first solution, the nearest to a posture, the most central one, or several.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.solve.answers import Answer, Answers
from toddle.reach.solve.damped_kernels import Arm
from toddle.reach.solve.reachable import Judgement, judged, settled
from toddle.reach.solve.redundancy import draw_near, unlike
from toddle.reach.solve.search_kernels import REACHED, REFUSED, search
from toddle.robots.chain import Chain
from toddle.robots.linkage import Linkage, linkage_of, poses
from toddle.signals import Verdict

Choice = Literal["first", "nearest", "central"]
RADIAN = 0.3  # what an angle of a radian counts for [m]
_COMPARED = {"first": (1, 0.0), "nearest": (8, 3.0), "central": (8, 3.0)}  # solutions; pull on their starts [m^2]
_ENDS = 16  # of the starts that failed, how many are brought to their minimum
_THOROUGH = 40  # and where nothing but the nearest is asked for
_MANY = 60  # solutions among which distinct ones are chosen
_BLOCK = 4096  # targets at a time


@dataclass(frozen=True)
class DampedSolver:
    """Answers for one arm; made by `damped_solver` or `solver_for`, and never changed.

    Attributes:
        arm: its constants, as the kernels read them.
        coordinates: which of x, y, z a target's position gives.
        tries: stored postures that a target is tried from before it counts as out of reach.
    """

    arm: Arm
    coordinates: tuple[int, ...]
    tries: int

    @property
    def lower(self) -> Float[np.ndarray, " joints"]:
        """Lower limits [rad or m]."""
        return self.arm.joints[0]

    @property
    def upper(self) -> Float[np.ndarray, " joints"]:
        """Upper limits [rad or m]."""
        return self.arm.joints[1]

    @property
    def _place(self) -> slice | list[int]:
        """Where a target's coordinates belong; a slice is the quicker index."""
        count = len(self.coordinates)
        return slice(count) if self.coordinates == (0, 1, 2)[:count] else list(self.coordinates)

    def solve(
        self,
        targets: Float[np.ndarray, "batch space"],
        turns: Float[np.ndarray, "batch 3 3"] | None = None,
        *,
        near: Float[np.ndarray, "*batch joints"] | None = None,
        choice: Choice = "first",
    ) -> Answers:
        """Answers for a batch of targets.

        Args:
            targets: where the tip should be [m].
            turns: rotations from the tip's frame to the base's; None: any.
            near: the present posture, or one for each target [rad or m]: the first start, and what "nearest" is near
                to; None: the stored postures are all there is, and the middle of the ranges.
            choice: "first": the first solution found; "nearest": the least far from ``near`` (each joint measured by
                its range); "central": the least far from the middle of the ranges. These two slide along the arm's
                self-motion.

        Returns:
            Joint values within the limits, also for targets out of reach: there the tip is as near as it comes.

        Raises:
            BadInput: the arrays don't fit the arm, a number isn't finite, or a turn is no rotation.
        """
        aims = self._aims(targets, turns)
        nears = None if near is None else self._nears(near, len(aims))
        rows = 3 if turns is None else 6
        found = np.empty((len(aims), len(self.lower) + 3))
        for first in range(0, len(aims), _BLOCK):
            part = slice(first, first + _BLOCK)
            present = nears if nears is None or len(nears) == 1 else nears[part]
            ends = self._search(aims[part], rows, present, _ENDS, *_COMPARED[choice])
            found[part] = self._chosen(ends, aims[part], rows, present, choice)
        q = found[:, :-3]
        held = (q <= self.lower) | (q >= self.upper)
        return Answers(q, found[:, -3], found[:, -2], found[:, -1] == REACHED, held)

    def solve_one(
        self,
        target: Float[np.ndarray, " space"],
        turn: Float[np.ndarray, "3 3"] | None = None,
        near: Float[np.ndarray, " joints"] | None = None,
        choice: Choice = "first",
    ) -> Answer:
        """The answer for one target, at the least cost; see `solve`.

        Raises:
            BadInput: the arrays don't fit the arm, a number isn't finite, or the turn is no rotation.
        """
        aim = self._aim(target, turn)
        rows, nears = 3 if turn is None else 6, None if near is None else self._nears(near, 1)
        found = self._search(aim, rows, nears, _ENDS, *_COMPARED[choice])
        row = found[0, 0]
        if choice != "first" or row[-1] != REACHED:
            row = self._chosen(found, aim, rows, nears, choice)[0]
        return Answer(row[:-3], float(row[-3]), float(row[-2]), bool(row[-1] == REACHED))

    def nearest(
        self, target: Float[np.ndarray, " space"], turn: Float[np.ndarray, "3 3"] | None = None
    ) -> tuple[Float[np.ndarray, " joints"], float, float]:
        """The posture that comes nearest to a target, and how far it stays from it [m], [rad].

        Looks longer than `solve` does: for the least of distance squared and (0.3 m times the angle) squared.

        Raises:
            BadInput: as `solve`.
        """
        aim, rows = self._aim(target, turn), 3 if turn is None else 6
        found = self._search(aim, rows, None, _THOROUGH)
        row = found[0, 0] if found[0, 0, -1] == REACHED else settled(self.arm, aim, rows, found)[0]
        return row[:-3], float(row[-3]), float(row[-2])

    def distinct(
        self,
        target: Float[np.ndarray, " space"],
        turn: Float[np.ndarray, "3 3"] | None = None,
        count: int = 4,
        *,
        near: Float[np.ndarray, " joints"] | None = None,
    ) -> Float[np.ndarray, "solutions joints"]:
        """Solutions that are clearly unlike each other, the nearest to the present posture first.

        Args:
            target: where the tip should be [m].
            turn: rotation from the tip's frame to the base's; None: any.
            count: how many, at most.
            near: the present posture [rad or m]; None: the middle of the ranges.

        Returns:
            None, one or more, at least 5 % of the ranges apart (root mean square over the joints).

        Raises:
            BadInput: as `solve`.
        """
        aim = self._aim(target, turn)
        nears = self.arm.joints[3:4] if near is None else self._nears(near, 1)
        found = self._search(aim, 3 if turn is None else 6, nears, _MANY, _MANY)[0]
        return unlike(self.arm, found[found[:, -1] == REACHED, :-3], nears[0], count)

    def judge(
        self,
        target: Float[np.ndarray, " space"],
        turn: Float[np.ndarray, "3 3"] | None,
        answer: Answer,
    ) -> Judgement:
        """Whether a target is reached, and what keeps the tip away.

        Args:
            target, turn: what was asked for.
            answer: the answer to it, from `solve_one`.
        """
        if answer.solved:
            return Judgement(Verdict.REACHED)
        return judged(self.arm, self._aim(target, turn)[0], 3 if turn is None else 6, answer.q)

    def _chosen(
        self, found: np.ndarray, aims: np.ndarray, rows: int, nears: np.ndarray | None, choice: Choice
    ) -> np.ndarray:
        """(batch, joints + 3) one answer for each target, from all that was found."""
        best = found[:, 0]
        lost = best[:, -1] != REACHED
        if choice != "first":
            middle = self.arm.joints[3:4]
            towards = middle if choice == "central" or nears is None else nears
            best = draw_near(self.arm, aims, rows, found, np.broadcast_to(towards, (len(aims), middle.shape[1])))
        if lost.any():
            best[lost] = settled(self.arm, aims[lost], rows, found[lost])
        return best

    def _search(
        self, aims: np.ndarray, rows: int, nears: np.ndarray | None, ends: int, wanted: int = 1, pull: float = 0.0
    ) -> np.ndarray:
        """(batch, ends, joints + 3) what the kernel finds."""
        arm = self.arm
        found = np.empty((len(aims), ends, arm.joints.shape[1] + 3))
        first = 0 if nears is None else -1
        tries = max(self.tries, 4 * wanted)
        search(arm, aims, rows, arm.joints[3:4] if nears is None else nears, first, tries, wanted, pull, found)
        if found[0, 0, -1] == REFUSED or (len(aims) > 1 and (found[:, 0, -1] == REFUSED).any()):
            raise BadInput(
                f"target {np.argmax(found[:, 0, -1] == REFUSED)} isn't finite, 1000 km away, or turned by no rotation",
                remedy="give metres, and a rotation matrix for the turn",
            )
        return found

    def _aim(self, target: np.ndarray, turn: np.ndarray | None) -> np.ndarray:
        aim = np.zeros((1, 12))
        try:
            aim[0, self._place] = target
            if turn is not None:
                aim[0, 3:] = np.asarray(turn).ravel()
        except (TypeError, ValueError) as error:
            raise BadInput("the target doesn't fit the arm", where=str(error)) from None
        return aim

    def _aims(self, targets: np.ndarray, turns: np.ndarray | None) -> np.ndarray:
        targets = np.asarray(targets, float)
        if targets.ndim != 2 or targets.shape[1] != len(self.coordinates):
            raise BadInput(f"targets of shape {targets.shape}", remedy=f"give (batch, {len(self.coordinates)})")
        aims = np.zeros((len(targets), 12))
        aims[:, self._place] = targets
        if turns is not None:
            if np.shape(turns) != (len(targets), 3, 3):
                raise BadInput(f"turns of shape {np.shape(turns)}", remedy=f"give ({len(targets)}, 3, 3)")
            aims[:, 3:] = np.reshape(turns, (-1, 9))
        return aims

    def _nears(self, near: np.ndarray, batch: int) -> np.ndarray:
        nears = np.atleast_2d(np.asarray(near, float))
        if nears.shape not in ((1, len(self.lower)), (batch, len(self.lower))) or not np.isfinite(nears).all():
            raise BadInput(
                f"a present posture of shape {np.shape(near)}, or one that isn't finite",
                remedy=f"give {len(self.lower)} joint values, or a row for each target",
            )
        return np.clip(nears, self.lower, self.upper)


def solver_for(chain: Chain, *, postures: int = 1024, tries: int = 48, seed: int = 0) -> DampedSolver:
    """The solver of a known robot description; see `damped_solver`."""
    lower, upper = np.asarray(chain.lower, float), np.asarray(chain.upper, float)
    return damped_solver(
        linkage_of(chain), lower, upper, coordinates=chain.coordinates, postures=postures, tries=tries, seed=seed
    )


def damped_solver(
    linkage: Linkage,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    coordinates: tuple[int, ...] = (0, 1, 2),
    tolerance: float = 1e-5,
    angle_tolerance: float = 1e-4,
    postures: int = 1024,
    tries: int = 48,
    seed: int = 0,
) -> DampedSolver:
    """The solver of a linkage.

    Args:
        linkage: the arm's constants, known or learned.
        lower: lower limits [rad or m].
        upper: upper limits.
        coordinates: which of x, y, z a target's position gives: (0, 1) for a planar arm.
        tolerance: the distance within which a target counts as reached [m].
        angle_tolerance: and the angle [rad].
        postures: stored starts, spread evenly over the ranges.
        tries: of those, how many a target is tried from before it counts as out of reach.
        seed: of the stored starts.

    Raises:
        BadInput: a number isn't finite, or a joint has no range.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    if not all(np.isfinite(part).all() for part in (*linkage, lower, upper)):
        raise BadInput("an arm with numbers that aren't finite", remedy="give every joint two limits")
    if not (lower < upper).all():
        joint = int(np.argmax(~(lower < upper)))
        raise BadInput(f"joint {joint} has no range: {lower[joint]} to {upper[joint]}", remedy="leave out fixed joints")
    starts = lower + (upper - lower) * np.random.default_rng(seed).random((max(postures, tries, 4 * _MANY), len(lower)))
    places = poses(linkage, starts)
    weight = np.array([*(float(axis in coordinates) for axis in range(3)), RADIAN, RADIAN, RADIAN])
    constants = np.concatenate([linkage.before, linkage.tip[None]])[:, :3].reshape(-1, 12)
    axis, joint = np.nonzero(linkage.gain)
    arm = Arm(
        before=np.ascontiguousarray(constants),
        axes=np.stack([linkage.offset, linkage.slides], axis=1),
        drives=np.stack([axis, joint, linkage.gain[axis, joint]], axis=1).astype(float),
        joints=np.stack(
            [lower, upper, (upper - lower) / np.mean(upper - lower), (lower + upper) / 2, _periods(linkage)]
        ),
        weight=weight,
        postures=starts,
        places=np.concatenate([places[:, :3, 3], places[:, :3, :3].reshape(-1, 9)], axis=1).T.astype(np.float32),
        within=np.array([tolerance, angle_tolerance]),
    )
    return DampedSolver(arm._replace(places=np.ascontiguousarray(arm.places)), tuple(coordinates), tries)


def _periods(linkage: Linkage) -> Float[np.ndarray, " joints"]:
    """After what motion of a joint the arm is in the same posture again [rad]; 0: after none."""
    moved = linkage.gain != 0
    alone = (moved.sum(axis=0) == 1) & ~(moved & (linkage.slides[:, None] > 0)).any(axis=0)
    gain = np.abs(linkage.gain).sum(axis=0)
    return np.where(alone, 2 * np.pi / np.where(alone, gain, 1.0), 0.0)
