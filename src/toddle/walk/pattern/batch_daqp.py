"""A batch of walkers by the single walker's own path, one after the other: exact, and the fastest on one core.

`outside.batch_solver` shares the walkers among processes; `batch` does the same in JAX.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.signals import Velocity
from toddle.walk.pattern.batch_state import STATUSES, BatchPlan, BatchState, single
from toddle.walk.pattern.nmpc import plan
from toddle.walk.pattern.nmpc_problem import Nmpc, Plan
from toddle.walk.pattern.obstacles import NONE


def plan_each(
    problem: Nmpc,
    states: BatchState,
    velocities: Float[np.ndarray, "walkers 3"],
    circles: Float[np.ndarray, "walkers circles 3"] | None = None,
    last: BatchPlan | None = None,
) -> BatchPlan:
    """One iteration of each walker; arguments and answer as in `batch.plan_batch`, in NumPy's arrays.

    Args:
        problem: of the gait, the same for all.
        states: where the walkers are.
        velocities: commanded: vx, vy [m/s], omega [rad/s].
        circles: obstacles: x, y, radius [m]; a negative radius for none.
        last: the last plans; where ``known`` is false there is none.
    """
    found = []
    for index, velocity in enumerate(np.asarray(velocities, float).tolist()):
        around = NONE if circles is None else _there(np.asarray(circles[index], float))
        before = None if last is None or not last.known[index] else _one(last, index)
        found.append(plan(problem, single(states, index), Velocity(*velocity), around, before))
    return _many(found, states)


def _there(circles: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "some 3"]:
    return circles[~(circles[:, 2] < 0)]


def _one(plans: BatchPlan, index: int) -> Plan:
    feet, moved, jerks, zmp = (np.array(part[index], float) for part in plans[:4])
    return Plan(
        feet,
        moved,
        jerks[:, 0],
        jerks,
        zmp,
        STATUSES[int(plans.status[index])],
        0.0,
        bool(plans.obstacle[index]),
        float(plans.violation[index]),
        float(plans.overlap[index]),
        single(plans.state, index),
    )


def _many(found: list[Plan], states: BatchState) -> BatchPlan:
    return BatchPlan(
        np.array([one.feet for one in found]),
        np.array([one.displacement for one in found]),
        np.array([one.jerks for one in found]),
        np.array([one.zmp for one in found]),
        np.array([STATUSES.index(one.status) for one in found], np.int32),
        np.array([one.obstacle for one in found]),
        np.array([one.violation for one in found]),
        np.array([one.overlap for one in found]),
        np.ones(len(found), bool),
        states,
    )
