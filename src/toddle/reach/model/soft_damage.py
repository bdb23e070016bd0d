"""What happened to a soft arm's actuators, several at once if need be, and the arm as it is now.

That something happened is noticed by `toddle.reach.model.damage_watch`, for any model. Then every actuator is moved
once by itself (`probe_movements`), and `diagnose` weighs for each of them: it is whole; it slips (it goes to another
place); it is locked (its place is unknown, and it follows no command); it is weak (its place and what remains of its
motion are unknown). With the misses r in units of what noise and the model's doubt explain, and the unknown numbers z
in units of what was to be expected, J the slope of r, a set of causes is judged by its evidence in Laplace's
approximation (MacKay 1992), log p = -1/2 (r'r + z'z + log det(I + J'J)), and by how rare damage is. First all numbers
are free; then one actuator after the other takes its likeliest cause while the others keep theirs, until none changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.reach.model.crippled import Crippled, number_slope
from toddle.reach.model.model import Model
from toddle.signals import Experience

KINDS = ("whole", "slip", "locked", "weak")
_FREE = {"whole": (False, False), "slip": (True, False), "locked": (True, False), "weak": (True, True)}
_RARE = np.log(1e3)  # odds against damage of one actuator
_PLACE, _SHARE = 0.4, 0.5  # what was to be expected: of a joint's range, of its motion
_STROKE = 0.4  # of a joint's range that a probe moves it by
_ROUNDS, _SWEEPS = 30, 6


class Diagnosis(NamedTuple):
    """What happened, and the body as it is now.

    Attributes:
        causes: joint, "locked", "weak" or "slip", and: where it is stuck [rad or m], what remains of its motion, or how
            far from its command it goes [rad or m]; for each that is broken.
        model: the body as it is now.
        free: joints that still move; a solver must not use the others.
        surprise: d^2 of the movements that is left, for each coordinate seen; about 1 or less where it explains them.
    """

    causes: tuple[tuple[int, str, float], ...]
    model: Crippled
    free: Bool[np.ndarray, " joints"]
    surprise: float


def probe_movements(
    q: Float[np.ndarray, " joints"], lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"]
) -> Float[np.ndarray, "joints joints"]:
    """One movement for each joint: it alone moves, to where it has more room; the next one starts from there.

    Args:
        q: the posture that is commanded now; the tip that was seen there goes before those of the probes [rad or m].
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
    """
    stroke = np.where(q - lower > upper - q, -_STROKE, _STROKE) * (upper - lower)
    return q + np.tril(np.ones((len(q), len(q)))) * stroke


def diagnose(
    model: Model,
    movements: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    sensor: float,
) -> Diagnosis:
    """The likeliest causes of what was seen since the body changed.

    Args:
        model: the body as it was learned, before.
        movements: those since, commanded and seen: the probes, and any others [rad or m, m].
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        sensor: standard deviation of a seen tip about the model on each axis [m].

    Raises:
        BadInput: there are no movements.
    """
    if not len(movements.q):
        raise BadInput("there are no movements since the damage", remedy="probe every joint once")
    seen = _Seen.of(model, movements, upper - lower, sensor)
    everything = _descended(seen, ["weak"] * len(lower), seen.expected(["weak"] * len(lower)), prior=1.0)
    kinds = [_likeness(share) for share in everything.numbers[len(lower) :]]
    state = _descended(seen, kinds, everything.numbers)
    for _ in range(_SWEEPS):
        before = list(kinds)
        for joint in np.argsort(np.abs(everything.numbers[len(lower) :])):
            for kind in KINDS:
                tried = [*kinds[:joint], kind, *kinds[joint + 1 :]]
                other = _descended(seen, tried, state.numbers) if kind != kinds[joint] else state
                if other.evidence > state.evidence:
                    state, kinds = other, tried
        if kinds == before:
            break
    return _diagnosed(seen, kinds, state, model)


class _State(NamedTuple):
    """Places, then shares; the evidence of their kinds; their covariance; squared misses."""

    numbers: Float[np.ndarray, " numbers"]
    evidence: float
    covariance: Float[np.ndarray, "numbers numbers"]
    misses: float


class _Seen(NamedTuple):
    """What was seen, and the inverse root of the covariance that noise and the model's doubt explain."""

    model: Model
    q: Float[np.ndarray, "movements joints"]
    x: Float[np.ndarray, "movements space"]
    about: Float[np.ndarray, " joints"]
    span: Float[np.ndarray, " joints"]
    white: Float[np.ndarray, "movements space space"]

    @classmethod
    def of(cls, model: Model, movements: Experience, span: Float[np.ndarray, " joints"], sensor: float) -> _Seen:
        covariance = model.spread(movements.q) + sensor**2 * np.eye(model.space)
        white = np.linalg.inv(np.linalg.cholesky(covariance))
        return cls(model, movements.q, movements.x, movements.q.mean(0), span, white)

    def expected(self, kinds: list[str]) -> Float[np.ndarray, " numbers"]:
        """Places and shares before anything is seen."""
        return np.concatenate([self.about, [{"locked": 0.0, "weak": 0.5}.get(kind, 1.0) for kind in kinds]])

    def around(
        self, numbers: Float[np.ndarray, " numbers"]
    ) -> tuple[Float[np.ndarray, " residuals"], Float[np.ndarray, "residuals numbers"]]:
        """Misses in units of what is explained, and how predictions change with the numbers in those units."""
        place, share = np.split(numbers, 2)
        tip, slope = self.model.slope(place + share * (self.q - self.about))
        miss = np.einsum("mij,mj->mi", self.white, self.x - tip).ravel()
        steep = self.white @ number_slope(slope, self.q - self.about)
        return miss, steep.reshape(len(miss), -1)


def _descended(
    seen: _Seen, kinds: list[str], numbers: Float[np.ndarray, " numbers"], prior: float | None = None
) -> _State:
    """Levenberg-Marquardt for the numbers that the kinds leave free, from given ones."""
    count = len(kinds)
    mean = seen.expected(kinds) if prior is None else np.concatenate([seen.about, np.full(count, prior)])
    free = np.array([_FREE[kind][0] for kind in kinds] + [_FREE[kind][1] for kind in kinds])
    numbers = np.where(free, numbers, mean)
    size = np.concatenate([_PLACE * seen.span, np.full(count, _SHARE)])[free]
    normal, damping = np.eye(len(size)), 1e-2

    def cost(miss: Float[np.ndarray, " residuals"], at: Float[np.ndarray, " numbers"]) -> float:
        return float(miss @ miss + (((at - mean)[free] / size) ** 2).sum())

    miss, steep = seen.around(numbers)
    now = cost(miss, numbers)
    for _ in range(_ROUNDS if free.any() else 0):
        across = steep[:, free] * size
        normal = np.eye(len(size)) + across.T @ across
        pull = across.T @ miss - (numbers - mean)[free] / size
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), pull)
        tried = numbers.copy()
        tried[free] += size * step
        tried_miss, tried_steep = seen.around(tried)
        gain = now - cost(tried_miss, tried)
        if gain > 0:
            numbers, miss, steep, now, damping = tried, tried_miss, tried_steep, now - gain, damping / 10
        else:
            damping *= 10
        if (0 < gain < 1e-4) or damping > 1e8:
            break
    covariance = np.zeros((2 * count, 2 * count))
    covariance[np.ix_(free, free)] = np.linalg.inv(normal) * np.outer(size, size)
    rare = _RARE * sum(kind != "whole" for kind in kinds)
    evidence = -0.5 * (now + float(np.linalg.slogdet(normal)[1])) - rare
    return _State(numbers, evidence, covariance, float(miss @ miss))


def _likeness(share: float) -> str:
    """The kind that a joint's share of motion suggests."""
    return "locked" if abs(share) < 0.2 else "weak" if share < 0.8 else "whole"


def _diagnosed(seen: _Seen, kinds: list[str], state: _State, model: Model) -> Diagnosis:
    place, share = np.split(state.numbers, 2)
    amounts = {"locked": place, "weak": share, "slip": place - seen.about}
    causes = tuple((j, kind, float(amounts[kind][j])) for j, kind in enumerate(kinds) if kind != "whole")
    body = Crippled(model, seen.about, place, share, state.covariance)
    free = np.array([kind != "locked" for kind in kinds])
    return Diagnosis(causes, body, free, state.misses / seen.x.size)
