"""The figures of a learned body, by the names that the JSON output uses: all on targets that it has never seen.

Open loop: joint values from the model alone. After looks: corrected by where the tip was seen. What it said of its own
errors stands beside what they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.evaluate.figures import error_figures, query_figures
from toddle.reach.gather import Sight, gather, truth
from toddle.reach.solve.looking import correct
from toddle.robots.body import Body, Plant
from toddle.signals import Verdict

if TYPE_CHECKING:
    from toddle.reach.body_skill import BodySkill

LOOKS = 6
_NEAR, _ALIGNED = 1e-3, 1e-2  # what counts as reached: [m], [rad]
_LOOKED_AT = 1024  # targets that are corrected by looking


def figures_of(
    skill: BodySkill,
    robot: Body | Plant,
    judge: Body | None,
    targets: Float[np.ndarray, "points space"],
    turns: Float[np.ndarray, "points 3 3"] | None,
) -> tuple[Float[np.ndarray, " fixed"], dict[str, object]]:
    """How well a skill does.

    Args:
        skill: what was learned, with its fixed test set.
        robot: what moves.
        judge: the body that says where the tip truly is; None: the robot's own sight does.
        targets: reachable ones that nobody has learned from [m].
        turns: how the tip is to be turned there; None: as it comes.

    Returns:
        The open-loop error on each point of the fixed test set [m], and the figures.
    """
    answers = skill.solver.solve(targets, turns)
    x, seen_turns = _tips(robot, judge, answers.q, turned=turns is not None)
    errors = np.linalg.norm(x - targets, axis=1)
    good = errors < _NEAR
    figures = _about(skill) | error_figures("open_loop_error", errors)
    if turns is not None and seen_turns is not None:
        angles = angle_between(turns, seen_turns)
        good &= angles < _ALIGNED
        figures |= {
            "orientation_error_mean_mrad": 1000 * float(angles.mean()),
            "orientation_error_p99_mrad": 1000 * float(np.percentile(angles, 99)),
        }
    mean, most = skill.expectation.at(answers.q)
    figures |= {
        "success_percent": 100 * float(good.mean()),
        "solved_percent": 100 * float(answers.solved.mean()),
        "expected_error_mean_mm": 1000 * float(mean.mean()),
        "expected_error_90_covers_percent": 100 * float((errors <= most).mean()),
        "verdicts": _verdicts(answers.distance > skill.doubt),
    }
    fixed = _error(skill, robot, judge, skill.targets)
    seen = _error(skill, robot, judge, skill.experience.x[: len(skill.fit.wild)][~skill.fit.wild][: len(targets)])
    figures |= error_figures("fixed_error", fixed) | error_figures("seen_error", seen)
    figures |= _looks(skill, robot, judge, targets[:_LOOKED_AT], answers.q[:_LOOKED_AT])
    solve = skill.solver.solve
    figures |= query_figures(lambda x: solve(x[None]).q[0], lambda x: solve(x).q, targets)
    return fixed, figures


def angle_between(
    one: Float[np.ndarray, "batch 3 3"], other: Float[np.ndarray, "batch 3 3"]
) -> Float[np.ndarray, " batch"]:
    """Angles of the rotations from one orientation to the other [rad]; exact for small ones, too."""
    gap = np.linalg.norm(one - other, axis=(1, 2))
    return 2 * np.arcsin(np.clip(gap / np.sqrt(8), 0, 1))


def _about(skill: BodySkill) -> dict[str, object]:
    """What was learned, from what."""
    config, fit = skill.config, skill.fit
    return {
        "robot": skill.source.called,
        "method": fit.kind,
        "why": skill.why,
        "structure_fits": skill.sound,
        "samples": len(skill.experience.q),
        "movements": len(skill.experience.q),
        "seed": config.seed,
        "noise_mm": 1000 * (config.noise or 0.0),
        "angle_noise_mrad": 1000 * config.angle_noise,
        "look_noise_mm": 1000 * config.look_noise,
        "noise_found_mm": 1000 * fit.sensor,
        "left_out": int(fit.wild.sum()),
        "fit_seconds": fit.seconds,
    }


def _verdicts(beyond: Bool[np.ndarray, " batch"]) -> dict[str, int]:
    counts = {Verdict.REACHED: int((~beyond).sum()), Verdict.OUT_OF_REACH: int(beyond.sum())}
    return {str(verdict): count for verdict, count in counts.items() if count}


def _tips(
    robot: Body | Plant, judge: Body | None, q: np.ndarray, *, turned: bool
) -> tuple[np.ndarray, np.ndarray | None]:
    """Where answers bring the tip: the plant has to go there, a body is asked."""
    if isinstance(robot, Body):
        return truth(robot, q, turned=turned)
    seen = gather(robot, q, Sight(), 0)
    return seen.x, truth(judge, q, turned=True)[1] if judge is not None and turned else None


def _error(skill: BodySkill, robot: Body | Plant, judge: Body | None, targets: np.ndarray) -> np.ndarray:
    return np.linalg.norm(_tips(robot, judge, skill.solver.solve(targets).q, turned=False)[0] - targets, axis=1)


def _looks(
    skill: BodySkill, robot: Body | Plant, judge: Body | None, targets: np.ndarray, q: np.ndarray
) -> dict[str, object]:
    """Errors after one look, after two, ...: true ones, of the answer that would be given then."""
    noise, rng = skill.config.look_noise, np.random.default_rng([skill.config.seed, LOOKS])

    def observe(q: np.ndarray) -> np.ndarray:
        x = _tips(robot, judge, q, turned=False)[0]
        return x + noise * rng.normal(size=x.shape)

    course = correct(
        skill.fit.model, skill.solver, observe, targets, q, LOOKS, sensor=noise, lower=skill.lower, upper=skill.upper
    )
    after = [np.linalg.norm(_tips(robot, judge, given, turned=False)[0] - targets, axis=1) for given in course.q[1:]]
    return {
        "after_looks_mean_mm": [1000 * float(errors.mean()) for errors in after],
        "after_looks_p99_mm": [1000 * float(np.percentile(errors, 99)) for errors in after],
        "after_looks_success_percent_1mm": 100 * float((after[-1] < _NEAR).mean()),
        **error_figures("closed_loop_error", after[2]),
    }
