"""The expert that networks learn from: it steers by the truth, but uses of it only what shows, or has shown lately.

It walks along the cheapest of 65 headings: towards the target or the first corner on the way to it (`detour`), clear of
what stands around, rather left of things than right of them, so that alike situations are answered alike, and rather
where the robot turns to already: whoever watches knows that too, and not what an expert meant to do. It waits for who
steps in the way, backs off from what is too near, turns around once to search, then moves on to where there is room. It
stands still within the target's radius. Walls always show: they are known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.navigate.cloning.detour import first_corner, free_lengths, gaps
from toddle.navigate.cloning.labels import FEWEST, MEMORY
from toddle.navigate.driver import Situation
from toddle.navigate.sight import PERIOD, Showing
from toddle.signals import STILL, Velocity

_HEADINGS = np.linspace(-2.1, 2.1, 65)  # relative to where it wants to go [rad]
_RIGHT = 2.5  # to the right is so much dearer
_BLOCKED = 20.0  # cost of a heading that touches something [rad]
_AHEAD = 1.0  # headings are compared so far [m]
_LEAD = 1.0  # where the robot turns to: it looks there after so long [s]
_TURN_BACK = 0.3  # what a radian aside costs where to go on with the search is chosen [m]
_RIGHT_FIRST, _ELSEWHERE = 0.25, 0.3  # what a radian to the right, and one away from there, cost [m]
_WALKS = 0.1  # who is seen to be faster is somebody [m/s]
_NOWHERE = (math.nan, math.nan)


class Known(NamedTuple):
    """What the expert remembers.

    Attributes:
        seen: when each thing showed last [s]; minus infinity: never.
        circles: x, y, radius of each as it then was [m].
        speed: of each, x, y, as it then was [m/s].
        walks: who was ever seen to walk.
        side: 1: search to the left, -1: to the right.
        turned: how far the search has turned [rad].
        yaw: at the last look [rad].
        towards: where the robot turns to [rad].
        refuge: where to go on with the search; NaN: nowhere.
        until: the walk there ends [s].
        waited: for people in the way, without going on in between [s].
        stands: it has reached the target.
    """

    seen: Float[np.ndarray, " things"]
    circles: Float[np.ndarray, "things 3"]
    speed: Float[np.ndarray, "things 2"]
    walks: Bool[np.ndarray, " things"]
    side: float = 1.0
    turned: float = 0.0
    yaw: float = math.nan
    towards: float = 0.0
    refuge: tuple[float, float] = _NOWHERE
    until: float = 0.0
    waited: float = 0.0
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
        people: whoever walks is remembered so long [s].
        patience: waits so long for somebody in the way, then goes around [s].
        period: between two decisions [s].
    """

    fastest: float = 0.2
    turning: float = 0.27
    berth: float = 0.42
    body: float = 0.31
    stop: float = 0.5
    memory: float = MEMORY
    people: float = 6.0
    patience: float = 15.0
    period: float = PERIOD

    def start(self) -> Known:
        """Nothing was seen."""
        return Known(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0, bool))

    def decide(self, memory: Known, situation: Situation) -> tuple[Velocity, Known]:
        """The velocity to walk at.

        Raises:
            BadInput: the situation doesn't tell what shows.
        """
        showing, t = situation.showing, situation.t
        if showing is None:
            raise BadInput("nobody tells the expert what shows", where="expert", remedy="let it drive through rooms")
        known = _looked(memory, showing, t)
        known = known._replace(towards=known.yaw + _LEAD * situation.velocity.omega)
        if t - known.seen[0] <= self.memory:
            bearing = _bearing(showing, known.circles[0])
            return self._approach(
                known._replace(turned=0.0, refuge=_NOWHERE, side=math.copysign(1.0, bearing)), showing, t
            )
        return self._search(known._replace(stands=False), showing, t)

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
            known = known._replace(refuge=_NOWHERE, turned=0.0)
        if known.turned < 2 * math.pi:
            back = self._back(self._around(known, t), showing)
            return Velocity(back, 0.0, known.side * self.turning), known
        aside = np.linspace(-math.pi, math.pi, 65)
        headings = showing.place[2] + aside
        free = free_lengths(showing.place[:2], headings, self._around(known, t), showing.hall, self.body, 2.0)
        best = int(np.argmax(free - _TURN_BACK * np.abs(aside)))
        far = max(float(free[best]) - 0.2, 0.3)
        refuge = showing.place[0] + far * math.cos(headings[best]), showing.place[1] + far * math.sin(headings[best])
        known = known._replace(refuge=refuge, until=t + 15.0)
        return self._walk(known, showing, refuge, t, 1.0)

    def _walk(
        self, known: Known, showing: Showing, goal: tuple[float, float], t: float, share: float
    ) -> tuple[Velocity, Known]:
        """Along the cheapest heading, unless somebody is to be waited for."""
        place, yaw = showing.place[:2], float(showing.place[2])
        around, end = self._around(known, t), np.array(goal)
        back = self._back(around, showing)
        somebody = self._in_the_way(known, showing, end, t)
        if somebody is not None and known.waited < self.patience:
            towards = _bearing(showing, somebody)
            omega = 0.0 if abs(towards) < 0.35 else math.copysign(self.turning, towards)
            return Velocity(back, 0.0, omega), known._replace(waited=known.waited + self.period)
        corner = first_corner(
            place, end, around, showing.hall, self.body + 0.03, known.towards, _RIGHT_FIRST, _ELSEWHERE
        )
        wanted = math.atan2(corner[1] - place[1], corner[0] - place[0])
        far = min(max(math.dist(corner, place), 0.2), _AHEAD)
        headings = wanted + _HEADINGS
        cost = np.abs(_HEADINGS) * np.where(_HEADINGS < 0, _RIGHT, 1.0)
        cost += self._danger(around, showing, headings, far)
        best = float(headings[int(np.argmin(cost))])
        off = math.remainder(best - yaw, 2 * math.pi)
        omega = min(max(1.2 * off, -self.turning), self.turning)
        free = float(free_lengths(place, np.array([yaw]), around, showing.hall, self.body - 0.02, 1.0)[0])
        ahead = self.fastest * min(share * max(1.0 - abs(off) / 0.7, 0.0), free / 0.5)
        known = known._replace(waited=0.0 if somebody is None else known.waited)
        return Velocity(back if back < 0 else ahead, 0.0, omega), known

    def _danger(
        self, around: Float[np.ndarray, "known 3"], showing: Showing, headings: Float[np.ndarray, " ways"], far: float
    ) -> Float[np.ndarray, " ways"]:
        """Cost of headings for what stands, or comes, beside them [rad]."""
        place = showing.place[:2]
        near = gaps(place, headings, around, far)
        short = np.clip((self.berth - near) / (self.berth - self.body), 0.0, 3.0)
        free = free_lengths(place, headings, around, showing.hall, self.body, far)
        return _BLOCKED * (1.0 - free / far) + short

    def _in_the_way(
        self, known: Known, showing: Showing, goal: Float[np.ndarray, "2"], t: float
    ) -> Float[np.ndarray, "3"] | None:
        """Where somebody is who stands, or will come, between here and the goal; None: nobody is."""
        place = showing.place[:2]
        fresh = known.walks & (t - known.seen <= self.people)
        fresh[0] = False
        way = math.atan2(goal[1] - place[1], goal[0] - place[0])
        far = min(float(np.hypot(*(goal - place))), 1.5)
        for circle, speed in zip(known.circles[fresh], known.speed[fresh], strict=True):
            for later in (0.0, 0.7, 1.4):
                then = circle + later * np.array([*speed, 0.0])
                if gaps(place, np.array([way]), then[None], far)[0] < self.berth:
                    return circle
        return None

    def _back(self, around: Float[np.ndarray, "known 3"], showing: Showing) -> float:
        """Backwards, when something is too near in front [m/s]; 0: nothing is."""
        for circle in around:
            near = math.dist(showing.place[:2].tolist(), circle[:2].tolist()) - circle[2] < self.body
            if near and abs(_bearing(showing, circle)) < 1.0:
                return -0.08
        return 0.0

    def _around(self, known: Known, t: float) -> Float[np.ndarray, "known 3"]:
        """What is remembered, the target left out; of who walks also where that will be in a second."""
        fresh = t - known.seen <= np.where(known.walks, self.people, self.memory)
        fresh[0] = False
        soon = known.circles[fresh & known.walks].copy()
        soon[:, :2] += known.speed[fresh & known.walks]
        return np.concatenate([known.circles[fresh], soon])


def _looked(known: Known, showing: Showing, t: float) -> Known:
    """What is known after a look."""
    things = len(showing.pixels)
    if len(known.seen) != things:
        nothing, still = np.full(things, -np.inf), np.zeros((things, 2))
        known = known._replace(seen=nothing, circles=showing.circles.copy(), speed=still, walks=np.zeros(things, bool))
    shows = showing.pixels >= np.where(np.arange(things) == 0, *FEWEST)
    since = t - known.seen
    moved = np.where((shows & (since < 0.5))[:, None], showing.circles[:, :2] - known.circles[:, :2], 0.0)
    speed = moved / np.where(np.isfinite(since) & (since > 0), since, 1.0)[:, None]
    yaw = float(showing.place[2])
    turn = 0.0 if math.isnan(known.yaw) else abs(math.remainder(yaw - known.yaw, 2 * math.pi))
    return known._replace(
        seen=np.where(shows, t, known.seen),
        circles=np.where(shows[:, None], showing.circles, known.circles),
        speed=np.where(shows[:, None], speed, known.speed),
        walks=known.walks | (np.hypot(*speed.T) > _WALKS),
        turned=known.turned + turn,
        yaw=yaw,
    )


def _bearing(showing: Showing, circle: Float[np.ndarray, "3"]) -> float:
    """Of a circle's middle, from where the robot looks [rad]."""
    x, y, yaw = showing.place.tolist()
    return math.remainder(math.atan2(circle[1] - y, circle[0] - x) - yaw, 2 * math.pi)
