"""Learning from recorded movements: nobody moves, so what can be said of its errors comes from the movements alone.

With a description of the robot its constants are corrected; without one, or where the description doesn't fit, the
body is learned from nothing. Errors are told by movements that were held out, each fold by a fit to all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.body_config import BodyConfig
from toddle.reach.body_run import Plan, skill_from
from toddle.reach.body_skill import BodySkill
from toddle.reach.evaluate.figures import error_figures, query_figures
from toddle.reach.structures import Known, fit_body, structure_named, suited
from toddle.robots.catalogue import Choice
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of
from toddle.signals import Experience

_FOLDS = 5
_ENOUGH = 100  # movements from which an arm is learned from nothing rather than by a doubtful correction
_STILL = 1e-6  # [m]
_WIDEST = 40.0  # [rad, m]: what goes further is told in degrees or millimetres
_BEYOND = 0.05  # of a joint's range: how far a recorded value may lie outside its limits


@dataclass(frozen=True)
class Recorded:
    """What recorded movements led to.

    Attributes:
        skill: the learned body.
        report: what was changed in the description, a line each; empty without one.
    """

    skill: BodySkill
    report: tuple[str, ...]


def learn_recorded(
    experience: Experience,
    joints: tuple[str, ...],
    source: Choice,
    *,
    described: Chain | None = None,
    method: str | None = None,
    seed: int = 0,
    where: str = "",
    tell: Callable[[str], None] = lambda _: None,
) -> Recorded:
    """Learn a body from recorded movements.

    Args:
        experience: the movements.
        joints: names of the joints.
        source: what `toddle.load` makes the described body from; its spec is empty without one.
        described: the robot as its file describes it; None: nothing is known of it.
        method: the structure to take; None: the description corrected, or what fits.
        seed: of all randomness.
        where: the file, for messages.
        tell: called with what is found on the way.

    Raises:
        BadInput: the movements can't be learned from, or are not this robot's.
    """
    known = _known(experience, joints, described, where)
    config = BodyConfig(
        method=method, movements=len(experience.q), seed=seed, noise=None, pose=experience.turn is not None
    )
    if described is not None and method is None:
        found = _corrected(experience, known, described, config, source, tell)
        if found is not None:
            return found
        method, config = "screws", replace(config, method="screws")
    names, why = suited(None)
    if method is not None:
        names, why = (structure_named(method).name,), "as asked for"
    skill = skill_from(experience, Plan(config, names, why, known, experience.q), source, tell)

    def fold(shown: Experience) -> Callable[[np.ndarray], np.ndarray]:
        return fit_body(shown, known, (skill.fit.kind,), seed, lambda _: None)[0].model.forward

    return Recorded(_told(skill, fold), ())


def _corrected(
    experience: Experience,
    known: Known,
    described: Chain,
    config: BodyConfig,
    source: Choice,
    tell: Callable[[str], None],
) -> Recorded | None:
    """The description, corrected; None where it is so wrong that the movements tell more alone."""
    from toddle.reach.model.corrected import correct
    from toddle.reach.model.corrected_changes import report
    from toddle.reach.model.misfit import fits

    nominal = linkage_of(described)

    def corrected(shown: Experience):
        return correct(nominal, shown, joints=known.joints, coordinates=described.coordinates, seed=config.seed)

    result = corrected(experience)
    for note in result.fit.notes:
        tell(note)
    if result.doubtful and len(experience.q) >= _ENOUGH:
        tell("so the body is learned from nothing")
        return None
    empty = np.empty((0, experience.x.shape[1]))
    sound = fits(experience, result.fit)
    skill = BodySkill(
        source, known.joints, known.lower, known.upper, known.home, replace(config, method="corrected"),
        "its description, corrected by the movements", result.fit, sound, experience, empty, np.empty(0), {},
    )  # fmt: skip
    return Recorded(_told(skill, lambda shown: corrected(shown).fit.model.forward), report(result.changes))


def _told(skill: BodySkill, fold: Callable[[Experience], Callable[[np.ndarray], np.ndarray]]) -> BodySkill:
    """The skill with figures from folds of its movements."""
    errors = held_out_errors(skill.experience, fold, skill.config.seed)
    tame = np.ones(len(errors), bool)
    tame[: len(skill.fit.wild)] = ~skill.fit.wild
    mean, most = skill.expectation.at(skill.experience.q)
    targets = skill.experience.x[tame]
    solver = skill.solver
    figures = {
        "robot": skill.source.called or "recorded",
        "method": skill.fit.kind,
        "why": skill.why,
        "structure_fits": skill.sound,
        "samples": len(errors),
        "movements": len(errors),
        "seed": skill.config.seed,
        "noise_found_mm": 1000 * skill.fit.sensor,
        "left_out": int(skill.fit.wild.sum()),
        "fit_seconds": skill.fit.seconds,
        **error_figures("held_out_error", errors[tame]),
        "expected_error_mean_mm": 1000 * float(mean.mean()),
        "expected_error_90_mean_mm": 1000 * float(most.mean()),
        **query_figures(lambda x: solver.solve(x[None]).q[0], lambda x: solver.solve(x).q, targets),
    }
    return replace(skill, targets=targets, errors=errors[tame], figures=figures)


def held_out_errors(
    experience: Experience, fold: Callable[[Experience], Callable[[np.ndarray], np.ndarray]], seed: int
) -> Float[np.ndarray, " movements"]:
    """Distance between seen and modelled tip in each movement [m], by a fit to the movements of other folds.

    Args:
        experience: the movements.
        fold: fits some movements, and returns the forward model.
        seed: of who is in which fold.
    """
    count = len(experience.q)
    part = np.random.default_rng(seed).permutation(count) % min(_FOLDS, count)
    errors = np.full(count, np.nan)
    for number in range(part.max() + 1):
        shown, held = part != number, part == number
        turn = None if experience.turn is None else experience.turn[shown]
        try:
            forward = fold(Experience(experience.q[shown], experience.x[shown], turn))
        except BadInput:  # enough movements for one fit, too few for four fifths of it
            continue
        errors[held] = np.linalg.norm(forward(experience.q[held]) - experience.x[held], axis=1)
    return errors


def _known(experience: Experience, joints: tuple[str, ...], described: Chain | None, where: str) -> Known:
    """Names and ranges: the description's, or those that were visited."""
    if np.ptp(experience.x, axis=0).max() < _STILL:
        raise BadInput("the tip never moves", where=where, remedy="record where it is seen, or watch another tip")
    if described is None:
        lower, upper = experience.q.min(axis=0), experience.q.max(axis=0)
        still = [name for name, low, high in zip(joints, lower, upper, strict=True) if not high > low]
        if still:
            raise BadInput(f"{still[0]} never moves", where=where, remedy="record movements in which it does")
        wide = int(np.argmax(upper - lower))
        if upper[wide] - lower[wide] > _WIDEST:
            ways = joints[wide], lower[wide], upper[wide]
            raise BadInput("{} goes from {:.3g} to {:.3g}".format(*ways), where=where, remedy="give radians and metres")
        return Known(joints, lower, upper, np.median(experience.q, axis=0))
    lower, upper, home = (np.asarray(v, float) for v in (described.lower, described.upper, described.home))
    if experience.x.shape[1] != len(described.coordinates):
        wanted = ", ".join("xyz"[axis] for axis in described.coordinates)
        raise BadInput(f"it has {experience.x.shape[1]} coordinates", where=where, remedy=f"give {wanted}")
    room = _BEYOND * (upper - lower)
    beyond = np.abs(np.clip(experience.q, lower - room, upper + room) - experience.q).max(axis=0)
    worst = int(np.argmax(beyond / (upper - lower)))
    if beyond[worst] > 0:
        ways = experience.q[:, worst].min(), experience.q[:, worst].max(), lower[worst], upper[worst]
        raise BadInput(
            "{} goes from {:.3g} to {:.3g}, its limits are {:.3g} to {:.3g}".format(joints[worst], *ways),
            where=where,
            remedy="give radians and metres, or the log of this robot",
        )
    return Known(joints, lower, upper, home)
