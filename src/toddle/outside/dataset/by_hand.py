"""A person drives, a room after the other, in real time."""

from __future__ import annotations

from collections.abc import Generator, Sequence

from toddle.navigate.cloning.recording import Recording
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.task import Outcome
from toddle.outside.dataset import layout
from toddle.outside.dataset.drives import Errand, How, start_of
from toddle.outside.navigation.room_run import run_room
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.teleoperation.keys import Keyboard
from toddle.outside.teleoperation.person import Person
from toddle.outside.teleoperation.seen import Seen
from toddle.outside.walk_run import warm_up
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL
from toddle.walk.walker import walker

_ENDS = {
    Outcome.WON: "You are there.", Outcome.COLLIDED: "You have run into something.", Outcome.FELL: "The robot fell.",
    Outcome.LATE: "The time was over.",
}  # fmt: skip


def by_hand(how: How, wanted: Sequence[Errand]) -> Generator[Recording, None, None]:
    """Every drive as it ends, until the person quits; a drive that was quit is none.

    Args:
        how: what the drives share; who drives is the person at the terminal.
        wanted: which.

    Raises:
        BadInput: there is no terminal, or no such robot or room.
    """
    humanoid = load_humanoid(how.recipe.robot, how.recipe.config)
    legs = walker(humanoid)
    warm_up(legs, HumanoidSimulation(humanoid, WorldOptions()))
    said = ""
    with Keyboard(legs.gait.fastest) as keyboard, Seen() as seen:
        for number, errand in enumerate(wanted, start=1):
            key = errand.room
            order = f"{said} {number} of {len(wanted)}: {layout.ORDERS[key.scenario]} Stop there.".strip()
            keyboard.velocity = STILL
            place = room(key.scenario, key.split, key.number, key.style)
            finish, recording = run_room(
                humanoid, Person(keyboard, seen, order), place, seed=errand.seed,
                start=start_of(errand, place, how.anywhere), eyes=how.eyes, called=how.called, rules=how.rules,
                before=legs,
            )  # fmt: skip
            if keyboard.ended:
                return
            said = _ENDS[finish.outcome]
            if recording is not None:
                yield recording
