"""The structures that a body may be taken to have, by name: the only place to edit to add one.

Each is a prior, declared: what is assumed of the body before its movements are looked at. The less is assumed, the more
movements it takes. `suited` says which one a body asks for; `fit_body` goes on to the next where the movements of a
body that nobody described say that one doesn't fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.failures import unknown_name
from toddle.reach.model.model import Fit
from toddle.robots.body import Body, Plant
from toddle.robots.chain import Chain
from toddle.robots.continuum import Continuum
from toddle.robots.soft_variants import SoftVariant
from toddle.signals import Experience

_MOST_PRODUCTS = 5  # joints whose products of 1, cos and sin are few enough
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Known:
    """What is known of a body before it is learned: names and ranges of its actuators, nothing of its shape."""

    joints: tuple[str, ...]
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    home: Float[np.ndarray, " joints"]


Fitter = Callable[[Experience, Known, int], Fit]


@dataclass(frozen=True)
class Structure:
    """A structure that a body may be taken to have.

    Attributes:
        name: on the command line.
        about: one line for the listing: what is assumed.
        movements: how many it learns from unless told otherwise.
        fit: from movements, what is known and a seed, to a model.
        designed: whether it is helped by movements of one joint at a time, made first.
        tests_itself: whether its errors can only be told by movements that are held out of the fit.
    """

    name: str
    about: str
    movements: int
    fit: Fitter
    designed: bool = False
    tests_itself: bool = False


def _screws(experience: Experience, known: Known, seed: int) -> Fit:
    from toddle.reach.model.screws import fit_screws

    return fit_screws(experience, joints=known.joints, seed=seed)


def _curvature(experience: Experience, known: Known, seed: int) -> Fit:
    from toddle.reach.model.curvature import fit_curvature

    return fit_curvature(experience, known.lower, known.upper, joints=known.joints, seed=seed)


def _multilinear(experience: Experience, known: Known, seed: int) -> Fit:
    from toddle.reach.model.multilinear import fit_multilinear

    return fit_multilinear(experience, known.lower, known.upper, seed=seed)


def _network(experience: Experience, known: Known, seed: int) -> Fit:
    from toddle.reach.model.network import fit_network

    return fit_network(experience, known.lower, known.upper, seed=seed)


_STRUCTURES = (
    Structure("screws", "rigid links on joints that turn or slide; nothing else is known", 300, _screws, True),
    Structure("curvature", "segments that bend in circular arcs, each by a few actuators", 2_000, _curvature),
    Structure(
        "multilinear",
        "rigid links on up to seven joints; fitted without iterations",
        2_000,
        _multilinear,
        tests_itself=True,
    ),
    Structure(
        "network",
        "nothing but that the tip's place follows from the joints, smoothly",
        20_000,
        _network,
        tests_itself=True,
    ),
)

STRUCTURES: Mapping[str, Structure] = {structure.name: structure for structure in _STRUCTURES}


def structure_named(name: str) -> Structure:
    """The structure of this name.

    Raises:
        BadInput: there is none; the nearest are named.
    """
    if name not in STRUCTURES:
        raise unknown_name("structure", name, STRUCTURES, where="--method")
    return STRUCTURES[name]


def suited(body: Body | Plant | None) -> tuple[tuple[str, ...], str]:
    """Which structures to try, the best first, and why.

    Args:
        body: what is to be learned; None: only its recorded movements are there.
    """
    if isinstance(body, Chain):
        count = len(body.joints)
        return ("screws",), f"a rigid arm ({count} joint{'s' * (count > 1)}), so its axes are looked for"
    if isinstance(body, Continuum | SoftVariant):
        return ("curvature",), f"a soft arm ({len(body.joints)} actuators), so its bending segments are looked for"
    joints = len(body.joints) if body is not None else 0
    few = ("multilinear",) if 0 < joints <= _MOST_PRODUCTS else ()
    return ("screws", "curvature", *few, "network"), "nobody described it, so one structure after the other is tried"


def part(experience: Experience, first: int, last: int) -> Experience:
    """The movements from one number to before another."""
    turn = None if experience.turn is None else experience.turn[first:last]
    return Experience(experience.q[first:last], experience.x[first:last], turn)


def _shown(experience: Experience, structure: Structure) -> Experience:
    """What a structure is fitted to: all movements, or all but the last tenth where some must be held out."""
    count = len(experience.q)
    return part(experience, 0, count - max(10, count // 10)) if structure.tests_itself else experience


def fit_body(experience: Experience, known: Known, names: tuple[str, ...], seed: int, tell: Tell) -> tuple[Fit, bool]:
    """The first structure that fits; the one that misses least where none does.

    Args:
        experience: the movements.
        known: what is known of the body.
        names: structures to try, in this order.
        seed: of all randomness.
        tell: called with what is found on the way.

    Returns:
        The fit, and whether what it misses can't be told from noise.

    Raises:
        BadInput: the movements can't be learned from.
    """
    from toddle.failures import BadInput
    from toddle.reach.model.misfit import fits

    tried: list[tuple[float, Fit]] = []
    refused: list[BadInput] = []
    for name in names:
        try:
            structure = structure_named(name)
            shown = _shown(experience, structure)
            fit = structure.fit(shown, known, seed)
        except BadInput as fault:
            refused.append(fault)
            continue
        if fits(shown, fit):
            return fit, True
        typical = float(np.median(fit.miss))
        tell(f"{fit.kind} doesn't fit: it misses by {1000 * typical:.1f} mm (median), more than noise would")
        tried.append((typical, fit))
    if not tried:
        raise refused[0]
    return min(tried, key=lambda pair: pair[0])[1], False
