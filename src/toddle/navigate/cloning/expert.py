"""The expert that networks learn from: it steers by the truth, but uses of it only what shows, or has shown lately.

It walks along the cheapest of 65 headings: towards the target, clear of what stands around, rather left of things than
right of them, so that alike situations are answered alike, and rather on as before. It waits for who steps in the way,
backs off from who comes too near, turns around once to search, then moves on to where there is room. It stands still
within the target's radius. Walls always show: they are known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.navigate.driver import Situation
from toddle.navigate.sight import PERIOD, Showing
from toddle.signals import Velocity
from toddle.walk.gate import STILL

_FEWEST = 6, 12  # pixels that show the target, and anything else
_HEADINGS = np.linspace(-2.1, 2.1, 65)  # relative to the goal's [rad]
_RIGHT = 2.5  # right of the goal is so much dearer
_BLOCKED = 20.0  # cost of a heading that touches something [rad]
_STRIDES = np.linspace(0.15, 1.0, 6)  # of a heading that is looked ahead, as shares


class Known(NamedTuple):
    """What the expert remembers.

    Attributes:
        seen: when each thing showed last [s]; minus infinity: never.
        circles: x, y, radius of each as it then was [m].
        speed: of each, x, y, as it then was [m/s].
        heading: the last one, in the room [rad]; NaN: none.
        side: 1: search to the left, -1: to the right.
        turned: how far the search has turned [rad].
        yaw: at the last look [rad].
        refuge: where to go on with the search; NaN: nowhere.
        until: the walk there ends [s].
        stands: it has reached the target.
    """

    seen: Float[np.ndarray, " things"]
    circles: Float[np.ndarray, "things 3"]
    speed: Float[np.ndarray, "things 2"]
    heading: float = math.nan
    side: float = 1.0
    turned: float = 0.0
    yaw: float = math.nan
    refuge: tuple[float, float] = (math.nan, math.nan)
    until: float = 0.0
    stands: bool = False


@dataclass(frozen=True)
class Expert:
    """Steers by what shows; see the head of this file.

    Attributes:
        fastest: ahead [m/s].
        turning: [rad/s].
        berth: kept from the waist to the rim of things, where there is room [m].
        body: never less than this [m].
        stop: stands still so near to the target's middle [m].
        memory: things are remembered so long [s].
        period: between two decisions [s].
    """

    fastest: float = 0.2
    turning: float = 0.27
    berth: float = 0.42
    body: float = 0.31
    stop: float = 0.5
    memory: float = 12.0
    period: float = PERIOD

    def start(self) -> Known:
        """Nothing was seen."""
        return Known(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 2)))

    def decide(self, memory: Known, situation: Situation) -> tuple[Velocity, Known]:
        """The velocity to walk at.

        Raises:
            BadInput: the situation doesn't tell what shows.
        """
        showing = situation.showing
        if showing is None:
            raise BadInput("nobody tells the expert what shows", where="expert", remedy="let it drive through rooms")
        known = _looked(memory, showing, situation.t)
        if situation.t - known.seen[0] <= self.memory:
            known = known._replace(turned=0.0, refuge=(math.nan, math.nan))
            return self._approach(known, showing, situation.t)
        return self._search(known._replace(stands=False), showing, situation.t)

    def _approach(self, known: Known, showing: Showing, t: float) -> tuple[Velocity, Known]:
        x, y, _ = known.circles[0].tolist()
        left = math.dist(showing.place[:2].tolist(), (x, y))
        if left <= (self.stop + 0.08 if known.stands else self.stop):
            return STILL, known._replace(stands=True)
        share = min(max((left - self.stop) / 0.35, 0.3), 1.0)
        return self._walk(known._replace(stands=False), showing, (x, y), t, share)

    def _search(self, known: Known, showing: Showing, t: float) -> tuple[Velocity, Known]:
        """Turns once around, then walks to where there is room, and turns again."""
        if math.isfinite(known.refuge[0]):
            if t <= known.until and math.dist(showing.place[:2].tolist(), known.refuge) > 0.25:
                return self._walk(known, showing, known.refuge, t, 1.0)
            known = known._replace(refuge=(math.nan, math.nan), turned=0.0)
        if known.turned < 2 * math.pi:
            back = self._too_near(known, showing, t)
            return Velocity(back, 0.0, known.side * self.turning), known._replace(heading=math.nan)
        headings = showing.place[2] + np.linspace(-math.pi, math.pi, 65)[1:]
        room = self._room(known, showing, headings, t)
        best = int(np.argmax(room))
        far = min(max(float(room[best]) - 0.2, 0.3), 1.6)
        refuge = showing.place[0] + far * math.cos(headings[best]), showing.place[1] + far * math.sin(headings[best])
        known = known._replace(refuge=refuge, until=t + 15.0, heading=math.nan)
        return self._walk(known, showing, refuge, t, 1.0)

    def _walk(
        self, known: Known, showing: Showing, goal: tuple[float, float], t: float, share: float
    ) -> tuple[Velocity, Known]:
        """Along the cheapest heading."""
        x, y, yaw = showing.place.tolist()
        towards, far = math.atan2(goal[1] - y, goal[0] - x), math.dist((x, y), goal)
        headings = towards + _HEADINGS
        cost = np.abs(_HEADINGS) * np.where(_HEADINGS < 0, _RIGHT, 1.0) + self._danger(known, showing, headings, far, t)
        if math.isfinite(known.heading):
            cost += 0.6 * np.abs(_wrapped(headings - known.heading))
        best = float(headings[int(np.argmin(cost))])
        off = math.remainder(best - yaw, 2 * math.pi)
        omega = min(max(1.2 * off, -self.turning), self.turning)
        ahead = self.fastest * share * max(1.0 - abs(off) / 0.7, 0.0)
        free = float(self._room(known, showing, np.array([yaw]), t)[0])
        ahead = min(ahead, self.fastest * min(max((free - 0.05) / 0.5, 0.0), 1.0))
        back = self._too_near(known, showing, t)
        return Velocity(back if back < 0 else ahead, 0.0, omega), known._replace(heading=best)

    def _danger(
        self, known: Known, showing: Showing, headings: Float[np.ndarray, " ways"], far: float, t: float
    ) -> Float[np.ndarray, " ways"]:
        """Cost of headings for what stands, or comes, beside them [rad]."""
        gaps = np.minimum(*self._gaps(known, showing, headings, min(far, 1.6), t))
        short = np.clip((self.berth - gaps) / (self.berth - self.body), 0.0, None)
        return np.where(gaps < self.body, _BLOCKED, 0.0) + 2.0 * np.minimum(short, 3.0)

    def _gaps(
        self, known: Known, showing: Showing, headings: Float[np.ndarray, " ways"], far: float, t: float
    ) -> tuple[Float[np.ndarray, " ways"], Float[np.ndarray, " ways"]]:
        """The least distances from the waist to rims, and to walls, that headings lead to [m]."""
        place, ways = showing.place[:2], np.stack([np.cos(headings), np.sin(headings)], axis=1)
        circles = self._around(known, t)
        gaps = np.full(len(headings), np.inf)
        if len(circles):
            off = circles[:, :2] - place
            along = np.clip(ways @ off.T, 0.0, far)
            apart = np.hypot(*(off[None] - along[..., None] * ways[:, None]).transpose(2, 0, 1)) - circles[:, 2]
            gaps = np.where(along > 0, apart, np.inf).min(axis=1)
        if showing.hall is None:
            return gaps, np.full(len(headings), np.inf)
        points = place + far * _STRIDES[:, None, None] * ways
        inside, here = showing.hall.inside(points).min(axis=0), float(showing.hall.inside(place))
        return gaps, np.where(inside < here - 1e-6, inside, np.inf)

    def _room(
        self, known: Known, showing: Showing, headings: Float[np.ndarray, " ways"], t: float
    ) -> Float[np.ndarray, " ways"]:
        """How far each heading may be walked [m], at most 3."""
        reached = np.zeros(len(headings))
        open_ = np.ones(len(headings), bool)
        for far in np.arange(0.1, 3.05, 0.1).tolist():
            open_ &= np.minimum(*self._gaps(known, showing, headings, far, t)) >= self.body
            reached[open_] = far
        return reached

    def _too_near(self, known: Known, showing: Showing, t: float) -> float:
        """Backwards, when somebody has come too near in front [m/s]; 0: nobody has."""
        circles, (x, y, yaw) = self._around(known, t), showing.place.tolist()
        for a, b, radius in circles.tolist():
            bearing = math.remainder(math.atan2(b - y, a - x) - yaw, 2 * math.pi)
            if abs(bearing) < 1.0 and math.dist((x, y), (a, b)) - radius < self.body - 0.03:
                return -0.08
        return 0.0

    def _around(self, known: Known, t: float) -> Float[np.ndarray, "known 3"]:
        """What is remembered, the target left out; what moves also where it will be in a second."""
        moves = _moves(known)
        fresh = t - known.seen <= np.where(moves, 0.25 * self.memory, self.memory)
        fresh[0] = False
        soon = known.circles[fresh & moves].copy()
        soon[:, :2] += known.speed[fresh & moves]
        return np.concatenate([known.circles[fresh], soon])


def _looked(known: Known, showing: Showing, t: float) -> Known:
    """What is known after a look."""
    things = len(showing.pixels)
    if len(known.seen) != things:
        known = known._replace(
            seen=np.full(things, -np.inf), circles=showing.circles.copy(), speed=np.zeros((things, 2))
        )
    shows = showing.pixels >= np.where(np.arange(things) == 0, *_FEWEST)
    since = t - known.seen
    speed = np.where((shows & (since < 0.5))[:, None], showing.circles[:, :2] - known.circles[:, :2], 0.0)
    speed /= np.where(np.isfinite(since) & (since > 0), since, 1.0)[:, None]
    yaw = float(showing.place[2])
    turn = 0.0 if math.isnan(known.yaw) else abs(math.remainder(yaw - known.yaw, 2 * math.pi))
    side = known.side
    if shows[0]:
        bearing = math.atan2(*(showing.circles[0, :2] - showing.place[:2])[::-1]) - yaw
        side = 1.0 if math.remainder(bearing, 2 * math.pi) >= 0 else -1.0
    return known._replace(
        seen=np.where(shows, t, known.seen),
        circles=np.where(shows[:, None], showing.circles, known.circles),
        speed=np.where(shows[:, None], speed, known.speed),
        side=side,
        turned=known.turned + turn,
        yaw=yaw,
    )


def _moves(known: Known) -> Bool[np.ndarray, " things"]:
    return np.hypot(*known.speed.T) > 0.1


def _wrapped(angles: Float[np.ndarray, " ways"]) -> Float[np.ndarray, " ways"]:
    return np.remainder(angles + math.pi, 2 * math.pi) - math.pi
