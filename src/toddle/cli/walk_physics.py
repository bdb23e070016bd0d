"""``toddle walk`` in physics: the robot, the world, who commands, and what is left of it."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.run_folder import new_folder
from toddle.cli.walk_folder import leave, tell
from toddle.failures import BadInput, ToddleError

if TYPE_CHECKING:
    from toddle.cli.walk import Task, Walk
    from toddle.outside.navigation.steered import Steered
    from toddle.outside.simulation.disturbances import WorldOptions
    from toddle.outside.simulation.humanoid import HumanoidSimulation
    from toddle.outside.teleoperation.keys import Keyboard
    from toddle.outside.walk_run import Watch
    from toddle.robots.gait import Gait
    from toddle.robots.humanoid import Humanoid
    from toddle.signals import Velocity
    from toddle.walk.follower import Follower
    from toddle.walk.loop import Moment, Walks
    from toddle.walk.walker import Walker

_STOPPED = 130


def walk_in_physics(asked: Walk) -> int:
    """Walk, leave a folder, tell the figures; returns the exit code."""
    from toddle.cli.walk import DEFAULT_ROBOT, task_of, tell_capped
    from toddle.outside.simulation.humanoid import HumanoidSimulation
    from toddle.outside.walk_figures import figures_of
    from toddle.outside.walk_record import Recorder
    from toddle.outside.walk_run import Watch, warm_up
    from toddle.outside.walk_trajectory import write_trajectory
    from toddle.robots.humanoids import load_humanoid

    spec = asked.robot or DEFAULT_ROBOT
    if asked.policy is not None:
        from toddle.outside.navigation.policy_files import load_policy
        from toddle.outside.navigation.steered import walking_source

        _ = walking_source(load_policy(asked.policy), asked.policy)  # refused before anything is told
    document = _document_gait(asked, spec)
    humanoid = load_humanoid(spec, asked.config)
    for note in humanoid.notes:
        print(f"{humanoid.name}: {note}", file=sys.stderr)
    walks = _walks(asked, humanoid, document)
    task = task_of(asked, walks.gait)
    tell_capped(task, _capped(walks.gait), humanoid.name)
    options = _world(asked, task)
    simulation = HumanoidSimulation(humanoid, options)
    folder = new_folder(asked.out, f"walk-{humanoid.name}")
    warm_up(walks, simulation)
    steered = _steered(asked, humanoid, simulation, task)
    recorder = Recorder()
    watch = Watch(recorder, simulation)
    with _filming(asked, simulation, folder) as film:
        try:
            until, stopped = _walk(asked, task, walks, simulation, steered, watch, film)
        except Exception:
            write_trajectory(folder / "trajectory.parquet", recorder.record())
            raise
    record = recorder.record()
    figures = {
        "robot": humanoid.name,
        "scenario": task.name,
        **figures_of(record, walks.gait, until=until, wall=watch.wall),
        "touched": bool(simulation.touched.any()) if task.circles else None,
    }
    leave(folder, record, walks.gait, figures, _config(asked, task, walks, options), task.circles)
    tell(figures, folder, as_json=asked.json)
    if record.fell:
        print(f"toddle: {humanoid.name} fell after {record.t[-1]:.1f} s", file=sys.stderr)
        return 1
    return _STOPPED if stopped else 0


def _capped(gait: Gait) -> Callable[[Velocity], Velocity]:
    """What the safety gate lets through in the end."""
    from toddle.signals import STILL
    from toddle.walk.gate import gate

    return lambda velocity: gate(STILL, velocity, gait.fastest, gait.sample, limited=False)


def _walk(
    asked: Walk,
    task: Task,
    walks: Walker | Follower,
    simulation: HumanoidSimulation,
    steered: Steered | None,
    watch: Watch,
    film: Callable[[float], None],
) -> tuple[float, bool]:
    """Walk to the end: until when it was commanded [s], and whether somebody interrupted it."""
    from toddle.outside.teleoperation.commands import follow, until
    from toddle.outside.teleoperation.keys import Keyboard
    from toddle.outside.terminal import stoppable
    from toddle.outside.walk_run import Heard

    with ExitStack() as stack:
        keyboard = stack.enter_context(Keyboard(walks.gait.fastest)) if asked.keys else None
        stop = stack.enter_context(stoppable())
        steering = keyboard or steered
        source = follow(task.legs, task.seconds) if steering is None else _for(steering, task.seconds)
        heard = Heard(until(lambda: stop.asked, source))
        show = _shown(stack, task, walks, keyboard)
        try:
            watch(
                _moments(task, walks, simulation, steered, heard),
                tell=show,
                film=film,
                real_time=lambda: keyboard is not None and not keyboard.ended,
            )
        except KeyboardInterrupt:  # the second Ctrl-C: what there is so far counts
            return heard.until, True
        return heard.until, stop.asked


def _for(source: Callable[[float], Velocity | None], seconds: float) -> Callable[[float], Velocity | None]:
    return lambda t: source(t) if t < seconds else None


def _steered(asked: Walk, humanoid: Humanoid, simulation: HumanoidSimulation, task: Task) -> Steered | None:
    """The robot with a policy on top, if one is asked for."""
    if asked.policy is None or asked.goal is None:
        return None
    from toddle.outside.navigation.steered import Steered, learned

    driver = learned(humanoid, asked.policy)
    return Steered(simulation, driver, asked.goal, task.circles, near=driver.task.near)


def _moments(
    task: Task,
    walks: Walks[Any],
    simulation: HumanoidSimulation,
    steered: Steered | None,
    heard: Callable[[float], Any],
) -> Iterator[Moment]:
    """The walk; pushes are told to the world once it has begun, since that forgets them at the start."""
    from toddle.walk.loop import walk

    for number, moment in enumerate(walk(walks, steered or simulation, heard, circles=task.circles)):
        if number == 0:
            for push in task.pushes:
                simulation.push(push.impulse, math.radians(push.direction), start=push.t)
        if steered is not None:
            steered.allowed = moment.allowed
        yield moment


def _shown(
    stack: ExitStack, task: Task, walks: Walker | Follower, keyboard: Keyboard | None
) -> Callable[[Moment], None]:
    """What tells a person how the walk goes: a panel for who drives, a bar for who waits."""
    from toddle.outside.teleoperation.keys import HELP
    from toddle.outside.teleoperation.panel import Panel
    from toddle.outside.terminal import Reporter

    name = walks.humanoid.name
    if keyboard is not None:
        panel = stack.enter_context(Panel(f"{name} walks", HELP))
        return _Telling(panel).tell
    total = math.ceil(task.seconds)
    reporter = stack.enter_context(Reporter(f"{name} walks, seconds", total))

    def tell_bar(moment: Moment) -> None:
        reporter.tell(min(int(moment.t), total - 1), f"ZMP margin {100 * moment.measured.margin:.1f} cm")

    return tell_bar


class _Telling:
    """Turns moments into what a panel shows."""

    def __init__(self, panel: Any) -> None:
        self._panel, self._began, self._distance, self._solver = panel, time.perf_counter(), 0.0, "-"

    def tell(self, moment: Moment) -> None:
        from toddle.outside.simulation.disturbances import TICK
        from toddle.outside.teleoperation.panel import Status

        velocity = moment.measured.velocity
        if math.isfinite(velocity.vx):
            self._distance += math.hypot(velocity.vx, velocity.vy) * TICK
        if moment.plan is not None:
            self._solver = str(moment.plan.status)
        clock = max(time.perf_counter() - self._began, 1e-9)
        self._panel.tell(
            Status(
                moment.t, moment.asked, moment.allowed, velocity, moment.measured.margin, moment.support,
                self._solver, moment.t / clock, self._distance,
            )
        )  # fmt: skip


def _filming(
    asked: Walk, simulation: HumanoidSimulation, folder: Path
) -> AbstractContextManager[Callable[[float], None]]:
    """What films, where there is something to draw with; otherwise a line says so."""
    from toddle.outside.walk_run import Filming

    nothing = nullcontext(lambda _: None)
    if asked.video is False or (asked.video is None and asked.keys):
        return nothing
    try:
        return Filming(simulation, folder / "walk.mp4", full=asked.video is True)
    except ToddleError as fault:
        print(f"toddle: no film: {fault.line}", file=sys.stderr)
        return nothing


def _world(asked: Walk, task: Task) -> WorldOptions:
    from toddle.outside.simulation.disturbances import SILENT, Noise, WorldOptions

    scale = asked.noise or 0.0
    noise = Noise(*(scale * deviation for deviation in asdict(Noise()).values())) if scale else SILENT
    given: dict[str, Any] = {
        "friction": asked.friction,
        "tilt_deg": asked.tilt,
        "mass_error": asked.mass_error,
        "delay_s": None if asked.delay is None else asked.delay / 1000,
        "lag_s": None if asked.lag is None else asked.lag / 1000,
    }
    known = {name: value for name, value in given.items() if value is not None}
    return WorldOptions(**known, noise=noise, circles=task.circles, seed=asked.seed)


def _walks(asked: Walk, humanoid: Humanoid, document: Gait | None) -> Walker | Follower:
    """Our walker, or the document's, where its gait is given."""
    if document is None:
        from toddle.walk.config import WalkConfig
        from toddle.walk.walker import walker

        return walker(humanoid, WalkConfig(deadline_ms=asked.deadline))
    from toddle.walk.follower import follower
    from toddle.walk.follower_state import FollowerConfig

    return follower(humanoid, document, FollowerConfig(deadline_ms=asked.deadline))


def _document_gait(asked: Walk, spec: str) -> Gait | None:
    """How the robot walks in Huber 2019, if that is asked for.

    Raises:
        BadInput: it does not occur there.
    """
    from toddle.robots.catalogue import HUMANOIDS

    if asked.weights == "default":
        return None
    gait = HUMANOIDS[spec].document_gait if spec in HUMANOIDS else None
    if gait is None:
        what = f"the document does not say how {spec} walks"
        raise BadInput(what, where="--weights document", remedy="take heicub, or add --pattern-only")
    return gait


def _config(asked: Walk, task: Task, walks: Walker | Follower, options: WorldOptions) -> dict[str, Any]:
    """What a reader needs to make the same again."""
    return {
        "robot": asked.robot or walks.humanoid.name,
        "config": None if asked.config is None else str(asked.config),
        "weights": asked.weights,
        "scenario": task.name,
        "legs": [[leg.t, *leg.velocity] for leg in task.legs],
        "seconds": task.seconds,
        "pushes": [push._asdict() for push in task.pushes],
        "seed": asked.seed,
        "gait": asdict(walks.gait),
        "walker": asdict(walks.config),
        "world": asdict(options),
    }
