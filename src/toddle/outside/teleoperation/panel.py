"""The status of a walk for who drives it: a panel on a terminal, a line every two seconds elsewhere.

Everything goes to standard error. A terminal that is lost is written to no more.
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from dataclasses import dataclass

from rich.console import Console
from rich.live import Live
from rich.panel import Panel as Frame
from rich.table import Table
from rich.text import Text

from toddle.signals import Velocity

_PANEL_SECONDS, _LINE_SECONDS = 0.1, 2.0
_FEET = {-1: "both", 0: "left", 1: "right"}
_BAR = 24
_FULL_MARGIN = 0.04  # [m]


@dataclass(frozen=True)
class Status:
    """What a panel shows.

    Attributes:
        t: time walked [s].
        asked: the command.
        allowed: what the safety gate let through.
        measured: the velocity achieved.
        margin: of the zero moment point inside the soles' polygon [m]; negative outside.
        support: the foot that carries: -1 both, 0 left, 1 right.
        solver: how the last plan ended.
        real_time_factor: simulated seconds for each second of the clock.
        distance: walked so far [m].
    """

    t: float
    asked: Velocity
    allowed: Velocity
    measured: Velocity
    margin: float
    support: int
    solver: str
    real_time_factor: float
    distance: float


class Panel:
    """Shows a status when it is told one, as often as an eye can follow."""

    def __init__(self, title: str, keys: str) -> None:
        self._title, self._keys = title, keys
        self._console = Console(stderr=True)
        self._live: Live | None = None
        self._last = -math.inf

    def __enter__(self) -> Panel:
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False)
            with contextlib.suppress(OSError):
                self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            with contextlib.suppress(OSError):
                self._live.stop()

    def tell(self, status: Status) -> None:
        """This is how it stands now."""
        now = time.monotonic()
        if now - self._last < (_LINE_SECONDS if self._live is None else _PANEL_SECONDS):
            return
        self._last = now
        with contextlib.suppress(OSError):  # the terminal is gone; whoever reads the keys finds out
            if self._live is None:
                print(line_of(status), file=sys.stderr, flush=True)
            else:
                self._live.update(frame_of(self._title, self._keys, status), refresh=True)


def line_of(status: Status) -> str:
    """The status on one line."""
    return (
        f"{status.t:.0f} s, {status.distance:.2f} m: asked {_velocity(status.asked)}, "
        f"measured {_velocity(status.measured)}, ZMP margin {100 * status.margin:.1f} cm, "
        f"{_FEET[status.support]}, {status.real_time_factor:.1f}x real time, {status.solver}"
    )


def frame_of(title: str, keys: str, status: Status) -> Frame:
    """The status as a panel."""
    table = Table(box=None, padding=(0, 2), show_edge=False)
    for head in ("", "ahead", "left", "turning left"):
        table.add_column(head, justify="left" if not head else "right")
    rows = (("command", status.asked), ("allowed", status.allowed), ("measured", status.measured))
    for name, velocity in rows:
        units = zip(velocity, ("m/s", "m/s", "rad/s"), strict=True)
        table.add_row(name, *(f"{part:+.3f} {unit}" if math.isfinite(part) else "-" for part, unit in units))
    facts = Table(box=None, padding=(0, 2), show_header=False, show_edge=False)
    facts.add_row("ZMP margin", _margin(status.margin))
    facts.add_row("support foot", _FEET[status.support])
    facts.add_row("NMPC", Text(status.solver, "green" if status.solver == "solved" else "yellow"))
    facts.add_row("time, distance", f"{status.t:.1f} s, {status.distance:.2f} m")
    facts.add_row("real-time factor", f"{status.real_time_factor:.2f}")
    whole = Table.grid()
    for part in (table, Text(), facts, Text(), Text(keys, "dim")):
        whole.add_row(part)
    return Frame(whole, title=title, title_align="left", expand=False)


def _margin(margin: float) -> Text:
    if not math.isfinite(margin):
        return Text("no contact", "bold red")
    colour = "green" if margin > 0.01 else "yellow" if margin > 0 else "bold red"
    full = round(_BAR * min(max(margin / _FULL_MARGIN, 0.0), 1.0))
    return Text("█" * full + "░" * (_BAR - full) + f" {100 * margin:+.1f} cm", colour)


def _velocity(velocity: Velocity) -> str:
    if not all(map(math.isfinite, velocity)):
        return "nothing yet"
    return f"{velocity.vx:+.2f} {velocity.vy:+.2f} m/s {velocity.omega:+.2f} rad/s"
