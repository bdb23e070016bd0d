"""``toddle reach`` by babbling: the inverse itself is learned, online, as infants do (Mahboob 2015, Rolf 2013)."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.reach import Reach
from toddle.cli.run_folder import leave, new_folder, refuse_used, tell_figures
from toddle.cli.units import metres
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.reach.session import Cycle, Session
    from toddle.robots.body import Body, Plant
    from toddle.robots.catalogue import Choice

_SAVE_SECONDS = 20.0
_LIVE_SAMPLES = 5_000
_OF_A_RUN = (
    "method", "learner", "samples", "seed", "hidden", "learning_rate", "perturbation", "network",
    "reading", "test_points", "test_spacing", "per_cycle",
)  # fmt: skip


def learn(asked: Reach) -> int:
    """Learn, leave a folder, and return the exit code."""
    from toddle.reach.api import suited
    from toddle.reach.config import ReachConfig
    from toddle.reach.methods import learner_named, with_method
    from toddle.robots.catalogue import Choice, settled

    given = {name: getattr(asked, name) for name in _OF_A_RUN if getattr(asked, name) is not None}
    if asked.plant == "physics":
        given.setdefault("samples", _LIVE_SAMPLES)
        given.setdefault("per_cycle", 500)
    if given.get("hidden") == (0,):
        given["hidden"] = ()
    config = ReachConfig(**given)
    learner_named(with_method(config, 0, 0))
    source = settled(Choice(asked.robot or "", asked.tip, asked.base, asked.joints))
    how = how_it_moves(asked)
    refuse_used(asked.out)
    session = _open(source, suited(config, source.spec), how)
    folder = new_folder(asked.out, source.spec)
    if config.method is None:
        size = f"{len(session.body.joints)} joints for {session.targets.shape[1]} coordinates"
        took = f"{session.config.method}, learner {session.config.learner}"
        print(f"{session.body.name}: {size}, so {took}", file=sys.stderr)
    from toddle.reach.session import start

    return _run(asked, session, start(session), source, how, folder)


def resume(asked: Reach, folder: Path) -> int:
    """Go on learning in a folder, and return the exit code."""
    from toddle.outside.files import make_folder
    from toddle.outside.skills import read_run, resume

    config, facts, tensors = read_run(folder)
    if asked.samples is not None:
        config = replace(config, samples=asked.samples)
    source, how = _recorded(facts, folder)
    make_folder(folder)
    session = _open(source, config, how)
    cycle = resume(session, tensors, str(folder))
    if cycle.samples >= session.samples:
        raise BadInput(
            f"it has learned from all its {cycle.samples} movements",
            where=str(folder),
            remedy=f"ask for more with --samples, such as {2 * cycle.samples}",
        )
    return _run(asked, session, cycle, source, how, folder)


def how_it_moves(asked: Reach) -> dict[str, Any]:
    """What moves, in the form that a run remembers.

    Raises:
        BadInput: noise is asked for where nothing is sensed.
    """
    if asked.noise is not None and asked.plant != "physics":
        raise BadInput("only physics has sensor noise here", where="--noise", remedy="add --plant physics")
    return {
        "plant": asked.plant or "kinematics",
        "noise": None if asked.noise is None else metres(asked.noise, "--noise"),
    }


def _recorded(facts: dict[str, Any], folder: Path) -> tuple[Choice, dict[str, Any]]:
    """Which robot a saved run has, and what moves."""
    from toddle.outside.skills import choice_from

    try:
        how = {"plant": facts["how"]["plant"], "noise": facts["how"]["noise"]}
        if how["plant"] not in ("kinematics", "physics") or not isinstance(how["noise"], float | None):
            raise ValueError(f"nothing moves by {how}")
        return choice_from(facts["choice"]), how
    except (LookupError, TypeError, ValueError) as fault:
        raise BadInput(
            f"it is not a run of this version ({fault})", where=str(folder), remedy="learn it again"
        ) from fault


def _open(source: Choice, config: Any, how: dict[str, Any]) -> Session:
    """The session of a robot, in kinematics or in physics."""
    from toddle.reach.api import hidden_of
    from toddle.reach.session import open_session
    from toddle.robots.catalogue import load_choice

    body = load_choice(source)
    return open_session(mover(body, how, config.seed), config, hidden=hidden_of(source.spec), survey=body)


def mover(body: Body, how: dict[str, Any], seed: int) -> Body | Plant:
    """What moves: the body as it is computed, or in physics."""
    if how["plant"] != "physics":
        return body
    from toddle.outside.simulation import PhysicsOptions, PhysicsPlant
    from toddle.robots.chain import Chain

    if not isinstance(body, Chain):
        raise BadInput("a soft arm has no physics here", where="--plant", remedy="leave --plant out")
    noise = {} if how["noise"] is None else {"noise": how["noise"]}
    return PhysicsPlant(body, PhysicsOptions(seed=seed, **noise))


def _run(asked: Reach, session: Session, cycle: Cycle, source: Choice, how: dict[str, Any], folder: Path) -> int:
    """Learn to the end or to Ctrl-C, save, evaluate, show."""
    from toddle.outside.skills import save, save_run
    from toddle.outside.terminal import Reporter, stoppable
    from toddle.reach.api import skill_of
    from toddle.reach.session import Pace, cycles

    facts = {"choice": asdict(source), "how": how}
    pace, saved = Pace(cycle.samples), time.perf_counter()
    with Reporter(f"{session.body.name} learns", session.samples) as reporter, stoppable() as stop:
        for latest in cycles(session, cycle):
            cycle = latest
            pace.tick(cycle.samples)
            reporter.tell(cycle.samples, f"error {1000 * float(cycle.history[-1].fixed_error):.1f} mm")
            if time.perf_counter() - saved > _SAVE_SECONDS:
                save_run(folder, session, cycle, facts)
                saved = time.perf_counter()
            if stop.asked:
                break
    save_run(folder, session, cycle, facts)
    skill = skill_of(session, cycle, source, pace=pace)
    save(skill, folder)
    leave(folder, session, cycle, skill)
    tell_figures(skill, folder, as_json=asked.json)
    if cycle.samples < session.samples:
        print(f"toddle: stopped; go on with: toddle reach --resume {folder}", file=sys.stderr)
        return 130
    return 0
