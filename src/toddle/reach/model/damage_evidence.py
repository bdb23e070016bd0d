"""How well hypotheses of damage explain what was seen, all of a family fitted side by side.

Levenberg-Marquardt on numbers z that are standard normal before anything is seen, every hypothesis with its own
damping; the misses are in units of what noise and the model's own doubt explain. The evidence is Laplace's
approximation (MacKay 1992), ``-1/2 (r'r + z'z + log det(I + J'J))`` up to a constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from toddle.reach.model.damage_hypotheses import Family
from toddle.reach.model.rigid import Rigid
from toddle.signals import Experience

_ROUNDS = 25


@dataclass(frozen=True)
class SeenSince:
    """What was seen, and what noise and the model's own doubt explain of it.

    Attributes:
        rows: which of the pose's rows were seen: 0 to 2 shift, 3 to 5 turn.
        x: where the tip was seen [m].
        turn: its orientation; None: not seen.
        white: inverse root of the covariance that is explained, movement by movement.
    """

    rows: list[int]
    x: Float[np.ndarray, "movements space"]
    turn: Float[np.ndarray, "movements 3 3"] | None
    white: Float[np.ndarray, "movements rows rows"]

    @classmethod
    def of(cls, model: Rigid, since: Experience, sensor: float, angle_sensor: float) -> SeenSince:
        """The movements since, and what the model as it was leaves open; standard deviations [m], [rad]."""
        rows = [*model.coordinates, *(() if since.turn is None else (3, 4, 5))]
        noise = np.diag([sensor**2 if row < 3 else angle_sensor**2 for row in rows])
        covariance = model.pose_spread(since.q)[:, rows][:, :, rows] + noise
        return cls(rows, since.x, since.turn, np.linalg.inv(np.linalg.cholesky(covariance)))

    def miss(self, pose: Float[np.ndarray, "cases movements 4 4"]) -> Float[np.ndarray, "cases residuals"]:
        """How far what was seen is from each prediction, in units of what is explained."""
        shape = pose.shape[:2]
        places = [row for row in self.rows if row < 3]
        miss = np.empty((*shape, len(self.rows)))
        miss[..., : len(places)] = self.x - pose[..., places, 3]
        if self.turn is not None:
            away = self.turn @ np.swapaxes(pose[..., :3, :3], -1, -2)
            miss[..., len(places) :] = Rotation.from_matrix(away.reshape(-1, 3, 3)).as_rotvec().reshape(*shape, 3)
        return np.einsum("mij,cmj->cmi", self.white, miss).reshape(shape[0], -1)

    def steep(
        self, slope: Float[np.ndarray, "cases movements 6 numbers"]
    ) -> Float[np.ndarray, "cases residuals numbers"]:
        """The slopes of the predictions in the same units."""
        return np.einsum("mij,cmjk->cmik", self.white, slope[:, :, self.rows]).reshape(len(slope), -1, slope.shape[3])


def fitted(
    family: Family, seen: SeenSince
) -> tuple[Float[np.ndarray, "cases numbers"], Float[np.ndarray, " cases"], Float[np.ndarray, "cases numbers numbers"]]:
    """Each hypothesis' numbers, its evidence and the covariance of its numbers; the best of its starts."""
    best = np.full(len(family.kinds), -np.inf)
    numbers, covariance = family.mean.copy(), family.root.copy()
    for start in family.starts:
        z, evidence, doubt = _descended(family, seen, np.tile(start, (len(best), 1)))
        better = evidence > best
        best[better] = evidence[better]
        found = family.mean + np.einsum("cij,cj->ci", family.root, z)
        numbers[better] = found[better]
        covariance[better] = (family.root @ doubt @ np.swapaxes(family.root, 1, 2))[better]
    return numbers, best, covariance


def _descended(
    family: Family, seen: SeenSince, z: Float[np.ndarray, "cases numbers"]
) -> tuple[Float[np.ndarray, "cases numbers"], Float[np.ndarray, " cases"], Float[np.ndarray, "cases numbers numbers"]]:
    """Levenberg-Marquardt from z, every case with its own damping: z, its evidence, and its covariance."""
    eye, damping = np.eye(z.shape[1]), np.full(len(z), 1e-2)
    cost, gradient, curvature = _around(family, seen, z)
    for _ in range(_ROUNDS):
        step = np.linalg.solve(curvature + damping[:, None, None] * eye, -gradient[..., None])[..., 0]
        tried_cost, tried_gradient, tried_curvature = _around(family, seen, z + step)
        good = tried_cost < cost
        z = np.where(good[:, None], z + step, z)
        gain = np.where(good, cost - tried_cost, 0.0)
        cost = np.where(good, tried_cost, cost)
        gradient = np.where(good[:, None], tried_gradient, gradient)
        curvature = np.where(good[:, None, None], tried_curvature, curvature)
        damping = np.where(good, damping / 10, damping * 10)
        if (gain < 1e-4).all() and (np.abs(step).max() < 1e-3 or (damping > 1e6).all()):
            break
    return z, -0.5 * (cost + np.linalg.slogdet(curvature)[1]), np.linalg.inv(curvature)


def _around(
    family: Family, seen: SeenSince, z: Float[np.ndarray, "cases numbers"]
) -> tuple[Float[np.ndarray, " cases"], Float[np.ndarray, "cases numbers"], Float[np.ndarray, "cases numbers numbers"]]:
    """Cost r'r + z'z, half its gradient, and the curvature I + J'J."""
    pose, slope = family.predict(family.mean + np.einsum("cij,cj->ci", family.root, z))
    miss, steep = seen.miss(pose), seen.steep(slope) @ family.root
    across = np.swapaxes(steep, 1, 2)
    gradient = z - np.einsum("cki,ci->ck", across, miss)
    return (miss**2).sum(1) + (z**2).sum(1), gradient, np.eye(z.shape[1]) + across @ steep
