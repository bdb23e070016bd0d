"""``toddle navigate evaluate``: who steers is judged, on the walking robot in physics, on its pattern, or on a task."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from toddle.cli.arguments import parse
from toddle.cli.navigate_folder import left_folder, refuse_used
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.navigate.policy import Policy
    from toddle.outside.navigation.course import Course, Finish
    from toddle.outside.navigation.named_tasks import TaskSource
    from toddle.outside.navigation.physics_batch import Recipe
    from toddle.outside.simulation.disturbances import WorldOptions

_PROG = "toddle navigate evaluate"
_TOLD_ELSEWHERE = ("env", "stopped")
_STAND_IN = "heicub"  # in physics, for who learned on wheels
_MOST = {"episodes": 100_000, "jobs": 1024, "circles": 20, "people": 10}


@dataclass(frozen=True)
class Evaluate:
    """Who steers the robot is judged: a learned policy, the scripted drivers that it is set beside, or a script.

    A policy that walks is judged in physics, whatever it was trained on; --pattern judges it on the walking pattern
    alone, in no time. A policy of the point gets the document's test, one of a Gymnasium environment its episodes.
    A policy that learned by watching, or the expert, drives through rooms, where it has only its eyes; with --rooms
    anybody does. The exit code is 0 whatever comes out.

    Attributes:
        policy: the folder that toddle navigate ppo or clone left.
        driver: who steers: the policy; a baseline that turns to the goal and walks there; the guide that plans the
            shortest way around obstacles; a script (--script); the expert, who knows what shows in a room.
        script: velocities from a file of lines "t vx vy omega", for --driver script.
        episodes: how many goals; how many rooms of each scenario.
        rooms: drive through rooms.
        scenario: which kinds of rooms; all six unless given.
        style: of their surfaces and light: as in training, or such as nobody trained on.
        split: of the rooms: test, or validation for choosing something by.
        eyes: how the robot sees there: a stereo pair, or small pictures by rays.
        pattern: judge on the walking pattern alone.
        robot: another robot than the policy was trained on: a name or a description's path.
        config: a TOML file that says what a humanoid's description leaves out.
        circles: at most so many obstacles; as in training unless given.
        people: so many walk around; as in training unless given.
        noise: of the sensors; 1 for those of a good robot.
        jobs: processes; one for each core unless given.
        seed: of the goals; far from those of training unless you choose otherwise.
        out: the folder to leave; runs/evaluate unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    policy: Path | None = None
    driver: Literal["policy", "baseline", "guide", "script", "expert"] = "policy"
    script: Path | None = None
    episodes: int = 100
    rooms: bool = False
    scenario: tuple[Literal["straight", "curve", "obstacle", "search", "person", "decoys"], ...] | None = None
    style: Literal["seen", "unseen"] = "seen"
    split: Literal["test", "validation"] = "test"
    eyes: Literal["stereo", "cast"] = "stereo"
    pattern: bool = False
    robot: str | None = None
    config: Path | None = None
    circles: int | None = None
    people: int | None = None
    noise: float | None = None
    jobs: int | None = None
    seed: int = 1000
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Judge, and return the exit code."""
    asked = parse(Evaluate, argv, prog=_PROG)
    _check(asked)
    if _in_rooms(asked):
        from toddle.cli.navigate_rooms import judge_in_rooms

        return judge_in_rooms(asked)
    if asked.driver == "policy":
        assert asked.policy is not None
        from toddle.outside.navigation.policy_files import load_policy

        policy = load_policy(asked.policy)
        if asked.pattern or policy.source.get("task") == "point" or "env" in policy.source:
            from toddle.cli.navigate_trial import try_out

            return try_out(asked, policy)
    return _judge_in_physics(asked)


def _check(asked: Evaluate) -> None:
    """Refuse what contradicts itself before anything heavy is imported."""
    if asked.driver == "policy" and asked.policy is None:
        raise BadInput("--policy is missing", where=_PROG, remedy="name the folder that toddle navigate ppo left")
    if asked.driver != "policy" and (asked.policy is not None or asked.pattern):
        flag = "--policy" if asked.policy is not None else "--pattern"
        raise BadInput(f"{flag} is of a policy, and {asked.driver} steers", where=_PROG, remedy="leave one out")
    if (asked.driver == "script") != (asked.script is not None):
        raise BadInput("--driver script and --script belong together", where=_PROG, remedy="give both")
    _check_rooms(asked)
    for name, most in _MOST.items():
        value = getattr(asked, name)
        least = 0 if name in ("circles", "people") else 1
        if value is not None and not least <= value <= most:
            raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=f"give {least} to {most}")
    if not 0 <= asked.seed < 2**31:
        raise BadInput(f"{asked.seed} is out of range", where="--seed", remedy=f"give 0 to {2**31 - 1}")
    if asked.noise is not None and not 0 <= asked.noise <= 1000:
        raise BadInput(f"{asked.noise:g} is out of range", where="--noise", remedy="give 0 to 1000")
    refuse_used(asked.out)


def _in_rooms(asked: Evaluate) -> bool:
    """Whether somebody drives through rooms."""
    from toddle.outside.navigation.room_policies import is_cloned

    return asked.rooms or asked.driver == "expert" or (asked.policy is not None and is_cloned(asked.policy))


def _check_rooms(asked: Evaluate) -> None:
    """Refuse what rooms have not, and what only rooms have."""
    if _in_rooms(asked):
        for flag, given in (("pattern", asked.pattern), ("circles", asked.circles), ("people", asked.people)):
            if given not in (None, False):
                raise BadInput(f"--{flag} is of no meaning in rooms", where=_PROG, remedy="leave it out")
        if asked.style == "unseen" and asked.split != "test":
            raise BadInput("the unseen style is kept for tests", where="--style", remedy="leave --split out")
        if asked.scenario is not None and len(set(asked.scenario)) < len(asked.scenario):
            raise BadInput("one is named twice", where="--scenario", remedy="name each once")
        return
    usual = Evaluate()
    for flag in ("scenario", "style", "split", "eyes"):
        if getattr(asked, flag) != getattr(usual, flag):
            raise BadInput(f"--{flag} is of rooms", where=_PROG, remedy="add --rooms")


def _judge_in_physics(asked: Evaluate) -> int:
    from toddle.outside.navigation.course import Rules, summary
    from toddle.outside.navigation.physics_batch import run_courses
    from toddle.outside.navigation.policy_files import load_policy
    from toddle.outside.terminal import Reporter, stoppable

    policy = None if asked.policy is None else load_policy(asked.policy)
    source, recipe = made(asked, policy)
    courses = draw_courses(asked.seed, asked.episodes, source.circles, source.people, Rules().seconds)
    with (
        left_folder(asked.out, "evaluate") as folder,
        stoppable() as stop,
        Reporter(f"{recipe.robot} in physics, courses", len(courses), quiet=asked.json) as reporter,
    ):
        done: list[Finish] = []

        def told(_: int, finish: Finish) -> None:
            done.append(finish)
            won = sum(f.outcome.name == "WON" for f in done)
            reporter.tell(len(done), f"{won} of {len(done)} reached")

        finishes = run_courses(
            recipe, courses, Rules(told=source.told), world=world_of(asked), seed=asked.seed, processes=asked.jobs,
            progress=told, stopped=lambda: stop.asked,
        )  # fmt: skip
        pairs = [(course, finish) for course, finish in zip(courses, finishes, strict=True) if finish is not None]
        if not pairs:
            return 130
        found = summary([finish for _, finish in pairs])
        figures = {
            "env": source.task, "robot": recipe.robot, "driver": asked.driver, "physics": True, "seed": asked.seed,
            "circles": source.circles, "people": source.people, **_judged(found),
            **({} if policy is None else learned_figures(policy.figures)),
        }  # fmt: skip
        _leave(folder, figures, pairs, f"{recipe.robot}: {found['won']} of {len(pairs)} goals")
    tell(figures, folder, as_json=asked.json)
    return 130 if stop.asked else 0


def made(asked: Evaluate, policy: Policy | None) -> tuple[TaskSource, Recipe]:
    """The task, and who steers whom; made once here, so that what can't be made is refused before anything begins.

    Raises:
        BadInput: the robot, the policy or the script is of no use.
    """
    from dataclasses import replace

    from toddle.outside.navigation.named_tasks import TASKS, UNICYCLE
    from toddle.outside.navigation.steered import walking_source
    from toddle.robots.humanoids import load_humanoid

    source = TASKS["goal"] if policy is None or asked.policy is None else walking_source(policy, asked.policy)
    if asked.robot == UNICYCLE:
        raise BadInput("an ideal robot has no body", where="--robot", remedy="name a humanoid, or add --pattern")
    robot = asked.robot or (_STAND_IN if source.robot == UNICYCLE else source.robot)
    known = None if source.robot_config is None or robot != source.robot else Path(source.robot_config)
    given = {"circles": asked.circles, "people": asked.people}
    source = replace(source, **{name: value for name, value in given.items() if value is not None})
    recipe = _recipe(asked, robot, asked.config or known)
    _ = recipe.make(load_humanoid(recipe.robot, recipe.config), *recipe.given)
    return source, recipe


def draw_courses(seed: int, count: int, circles: int, people: int, seconds: float) -> list[Course]:
    """Goals, obstacles and people that training never saw; each can be solved, by an independent planner."""
    from dataclasses import replace

    from toddle.navigate.scenarios.planner import solvable_layouts
    from toddle.outside.navigation.course import courses_of, strolls

    layouts, _, _ = solvable_layouts(seed, count, circles=circles)
    courses = list(courses_of(layouts))
    if people:
        courses = [
            replace(course, people=strolls(seed + number, course.goal, people, seconds, clear=0.95))
            for number, course in enumerate(courses)
        ]
    return courses


def learned_figures(figures: Any) -> dict[str, Any]:
    """What training told of itself."""
    names = ("steps", "train_seconds", "compile_seconds", "steps_per_second")
    return {name: figures[name] for name in names if name in figures}


def _recipe(asked: Evaluate, robot: str, config: Path | None) -> Recipe:
    from toddle.navigate.cloning.expert import Expert
    from toddle.outside.navigation.guided import Guided
    from toddle.outside.navigation.physics_batch import Recipe, baseline, same
    from toddle.outside.navigation.steered import learned, scripted

    match asked.driver:
        case "policy":
            return Recipe(learned, (asked.policy,), robot, config)
        case "baseline":
            return Recipe(baseline, (), robot, config)
        case "guide":
            return Recipe(same, (Guided(),), robot, config)
        case "script":
            return Recipe(scripted, (asked.script,), robot, config)
        case "expert":
            return Recipe(same, (Expert(),), robot, config)


def world_of(asked: Evaluate) -> WorldOptions | None:
    """The world of what is asked; None: the usual one."""
    from dataclasses import asdict

    from toddle.outside.simulation.disturbances import Noise, WorldOptions

    if not asked.noise:
        return None
    return WorldOptions(noise=Noise(*(asked.noise * deviation for deviation in asdict(Noise()).values())))


def _judged(found: dict[str, Any]) -> dict[str, Any]:
    from toddle.outside.navigation.statistics import wilson

    low, high = wilson(found["won"], found["courses"])
    return {
        "episodes": found["courses"], "success_rate": found["success_rate"], "wilson_low": low, "wilson_high": high,
        "wins": found["won"], "losses": found["courses"] - found["won"], "collisions": found["collisions"],
        "falls": found["falls"], "late": found["late"], "lost": found["lost"], "seconds_mean": found["seconds_mean"],
        "spl": found["spl_mean"], "zmp_error_mean_cm": 100 * found["zmp_error_mean"],
    }  # fmt: skip


def _leave(folder: Path, figures: dict[str, Any], pairs: list[tuple[Course, Finish]], title: str) -> None:
    from toddle.outside.files import write_json
    from toddle.outside.navigation.course_pictures import all_paths, cases

    courses, finishes = [course for course, _ in pairs], [finish for _, finish in pairs]
    write_json(folder / "figures.json", figures)
    rows = [
        {"goal": list(c.goal), "outcome": f.outcome.name.lower(), "seconds": f.seconds, "spl": f.spl} for c, f in pairs
    ]
    write_json(folder / "courses.json", {"courses": rows})
    all_paths(folder / "paths.png", courses, finishes, title=title)
    cases(folder / "cases.png", courses[:4], finishes[:4], title=title)


def tell(figures: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    """The figures on standard output: one JSON object, or a table."""
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**figures, "folder": str(folder)})))
        return
    shown = [
        (name.replace("_", " "), _shown(value))
        for name, value in figures.items()
        if isinstance(value, str | int | float) and name not in _TOLD_ELSEWHERE
    ]
    print_table(str(figures.get("env", "")), ("", "this run"), shown)
    print(f"figures and pictures: {folder}")
    sys.stdout.flush()


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
