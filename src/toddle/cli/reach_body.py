"""``toddle reach`` by learning the body: movements, a fit, a test, and what they leave in a folder."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.body_folder import leave
from toddle.cli.reach import Reach
from toddle.cli.reach_babbling import mover
from toddle.cli.run_folder import new_folder, refuse_used, tell_figures
from toddle.cli.units import metres, sight
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.reach.body_config import BodyConfig
    from toddle.reach.body_run import Plan
    from toddle.reach.body_skill import BodySkill
    from toddle.reach.working import Work
    from toddle.robots.body import Body, Plant
    from toddle.robots.catalogue import Choice
    from toddle.signals import Experience

MOVEMENTS = "movements"
FORMATS = (".onnx", ".jax")
_SAVE_SECONDS = 5.0
_CHUNK = 20  # movements between two looks at the clock, on a plant


def learn(asked: Reach) -> int:
    """Learn a body, leave a folder, and return the exit code."""
    from toddle.reach.body_run import plan
    from toddle.reach.structures import structure_named
    from toddle.robots.catalogue import Choice, load_choice, settled
    from toddle.robots.chain import Chain

    begun = time.perf_counter()
    config = _config(asked)
    if config.method is not None:
        structure_named(config.method)
    source = settled(Choice(asked.robot or "", asked.tip, asked.base, asked.joints))
    refuse_used(asked.out)
    refuse_files(asked)
    body = load_choice(source)
    tell_notes(body, source.called)
    if asked.propose is not None:
        from toddle.cli.reach_export import propose_first

        propose_first(body, asked.propose)
        return 0
    if asked.to_urdf is not None and not isinstance(body, Chain):
        raise BadInput(f"{source.spec} has no rigid links", where="--to-urdf", remedy="leave it out")
    how = {"plant": asked.plant or "kinematics", "noise": config.noise if asked.plant == "physics" else None}
    robot = mover(body, how, config.seed)
    work = work_of(asked, body, how["plant"], len(plan(robot, config, like=body).q))
    return _run(asked, robot, body, config, source, how, asked.out, begun, work=work)


def resume(asked: Reach, folder: Path) -> int:
    """Make more movements in a folder, fit again, and return the exit code."""
    from toddle.outside.body_skills import read_movements_made
    from toddle.outside.files import make_folder
    from toddle.outside.skills import choice_from
    from toddle.robots.body import Resumable
    from toddle.robots.catalogue import load_choice

    begun = time.perf_counter()
    experience, config, facts, state = read_movements_made(folder)
    if asked.samples is not None:
        config = replace(config, movements=asked.samples)
    try:
        source, how = choice_from(facts["choice"]), {name: facts["how"][name] for name in ("plant", "noise")}
    except (LookupError, TypeError, ValueError) as fault:
        raise BadInput(f"it is not a run of this version ({fault})", where=str(folder), remedy="learn again") from fault
    made = len(experience.q)
    if made >= (config.movements or made):
        raise BadInput(
            f"it has learned from all its {made} movements",
            where=str(folder),
            remedy=f"ask for more with --samples, such as {2 * made}",
        )
    make_folder(folder)
    body = load_choice(source)
    robot = mover(body, how, config.seed)
    if isinstance(robot, Resumable):
        robot.restore(state)
    return _run(asked, robot, body, config, source, how, folder, begun, made=experience)


def _config(asked: Reach) -> BodyConfig:
    from toddle.reach.body_config import BodyConfig

    noise, angle_noise = sight(asked.noise, "--noise")
    if angle_noise and asked.plant == "physics":
        raise BadInput("physics shows no orientation", where="--noise", remedy="give a length alone, such as 1mm")
    if asked.pose and asked.plant == "physics":
        raise BadInput("physics shows no orientation", where="--pose", remedy="leave one of them out")
    given = {"method": asked.method, "movements": asked.samples}
    for name in ("seed", "test_points"):
        if getattr(asked, name) is not None:
            given[name] = getattr(asked, name)
    look_noise = 0.0 if asked.look_noise is None else metres((asked.look_noise,), "--look-noise")
    pose = asked.pose or angle_noise > 0
    return BodyConfig(noise=noise, angle_noise=angle_noise, look_noise=look_noise, pose=pose, **given)


def work_of(asked: Reach, body: Body, plant: str, movements: int) -> Work | None:
    """What breaks while the body works; None: nothing was asked for."""
    if not asked.damage:
        return None
    from toddle.reach.working import work_plan
    from toddle.robots.chain import Chain

    if plant != "kinematics":
        raise BadInput("nothing breaks in physics", where="--damage", remedy="leave --plant out")
    return work_plan(asked.damage, body, movements, body.carriers if isinstance(body, Chain) else {})


def tell_notes(body: Body, spec: str) -> None:
    """Say what was inferred about a robot from its file."""
    for note in getattr(body, "notes", ()):
        print(f"{spec}: {note}", file=sys.stderr)


def refuse_files(asked: Reach) -> None:
    """Refuse to write over a file, into a folder that isn't there, or in a format that there isn't."""
    for path in asked.to or ():
        if path.suffix not in FORMATS:
            raise BadInput(f"{path.name} names no format", where="--to", remedy=f"end it with {' or '.join(FORMATS)}")
    for path in (*(asked.to or ()), *([asked.to_urdf] if asked.to_urdf else [])):
        if path.exists():
            raise BadInput("it is there already", where=str(path), remedy="name another file")
        if not path.parent.is_dir():
            raise BadInput("its folder is not there", where=str(path), remedy="make it, or name another")


def _run(
    asked: Reach,
    robot: Body | Plant,
    body: Body,
    config: BodyConfig,
    source: Choice,
    how: dict[str, Any],
    out: Path | None,
    begun: float,
    *,
    made: Experience | None = None,
    work: Work | None = None,
) -> int:
    """Make the movements, fit, test, save, show."""
    from toddle.outside.body_skills import save_movements
    from toddle.outside.skills import save
    from toddle.reach.body_run import plan, skill_from, tested
    from toddle.reach.gather import gather
    from toddle.robots.body import Body

    longer = made if made is not None and len(made.q) < (config.movements or 0) and asked.samples is not None else None
    to_do = plan(robot, config, like=body, made=longer)
    facts = {"choice": asdict(source), "how": how}

    def tell(news: str) -> None:
        print(f"{source.called}: {news}", file=sys.stderr)

    if isinstance(robot, Body):  # its movements cost nothing: no folder before they are known to be worth one
        experience, stopped = gather(robot, to_do.q, to_do.sight, config.seed), False
        tell(to_do.why)
        skill = skill_from(experience, to_do, source, tell)
        folder = new_folder(out, source.spec) if made is None else out or Path()
        save_movements(folder, experience, to_do.config, facts, robot)
    else:
        tell(to_do.why)
        folder = new_folder(out, source.spec) if made is None else out or Path()
        experience, stopped = _move(robot, to_do, made, folder, facts)
        skill = skill_from(experience, to_do, source, tell)
    for note in skill.fit.notes:
        tell(note)
    skill = tested(skill, robot, body, time.perf_counter() - begun)
    save(skill, folder)
    leave(folder, skill)
    if work is not None and not stopped:
        from toddle.cli.reach_damage import go_on_working

        skill = replace(skill, figures={**skill.figures, **go_on_working(skill, body, work, folder)})
    after(asked, skill)
    skill = replace(skill, figures={**skill.figures, "total_seconds": time.perf_counter() - begun})
    tell_figures(skill, folder, as_json=asked.json)
    if stopped:
        print(f"toddle: stopped; go on with: toddle reach --resume {folder}", file=sys.stderr)
        return 130
    return 0


def after(asked: Reach, skill: BodySkill) -> None:
    """What was asked for beside learning: files of the body and of the skill."""
    if asked.to_urdf is not None:
        from toddle.cli.reach_export import write_urdf

        write_urdf(skill, asked.to_urdf)
    for path in asked.to or ():
        from toddle.cli.reach_export import export

        export(skill, path)


def _move(
    robot: Plant, to_do: Plan, made: Experience | None, folder: Path, facts: dict[str, Any]
) -> tuple[Experience, bool]:
    """The movements of a plan, those that were made already included; and whether somebody asked to stop."""
    from toddle.outside.body_skills import save_movements
    from toddle.outside.terminal import Reporter, stoppable
    from toddle.reach.gather import gather, together

    config, q = to_do.config, to_do.q
    saved, stopped = time.perf_counter(), False
    with Reporter(f"{robot.name} moves", len(q)) as reporter, stoppable() as stop:
        for first in range(0 if made is None else len(made.q), len(q), _CHUNK):
            more = gather(robot, q[first : first + _CHUNK], to_do.sight, config.seed)
            made = more if made is None else together(made, more)
            reporter.tell(len(made.q), "")
            if stop.asked:
                stopped = True
                break
            if time.perf_counter() - saved > _SAVE_SECONDS:
                save_movements(folder, made, config, facts, robot)
                saved = time.perf_counter()
    if made is None:
        raise BadInput("no movement was made", where=robot.name, remedy="ask for more with --samples")
    save_movements(folder, made, config, facts, robot)
    return made, stopped and len(made.q) < len(q)
