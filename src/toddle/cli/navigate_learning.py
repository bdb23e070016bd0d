"""What ``toddle navigate ppo`` does: the task is made, a run begins or goes on in its folder, somebody may stop it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from toddle.cli.navigate_folder import left_folder
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.cli.navigate_ppo import Ppo
    from toddle.navigate.policy import Policy
    from toddle.navigate.ppo.config import PpoConfig
    from toddle.outside.navigation.ppo_run import Plan, Run

PROG = "toddle navigate ppo"
UNSEEN = 1_000_000
"""Seeds of trials lie so far from those of training."""
NUMBERS = (
    "steps", "actors", "horizon", "minibatch", "epochs", "gamma", "lambda_", "epsilon", "c1", "c2", "learning_rate",
    "schedule", "kl_limit", "hidden", "activation", "memory", "sequence", "bound", "deviation",
)  # fmt: skip
"""Options that are numbers of `toddle.navigate.ppo.config.PpoConfig`."""
_DEFAULT = "goal"
_BATCH = 2**24  # transitions between two updates, of all seeds together


class Job(NamedTuple):
    """What is to be learned, and how.

    Attributes:
        name: of the task or the environment.
        source: how the task is made again.
        config: of the learning.
        seed: of the first run.
        seeds: how many run side by side.
        resumed: the folder of the run that goes on.
    """

    name: str
    source: Mapping[str, Any]
    config: PpoConfig
    seed: int
    seeds: int
    resumed: Path | None


class Learned(NamedTuple):
    """What came of it.

    Attributes:
        run: the run.
        judge: tries its policies out, by a seed.
        folder: where it is kept.
    """

    run: Run
    judge: Callable[[Policy, int], dict[str, Any]]
    folder: Path


def job_of(asked: Ppo) -> Job:
    """What is asked for.

    Raises:
        BadInput: it does not fit together, or there is no run to go on with.
    """
    from toddle.navigate.ppo.presets import preset
    from toddle.outside.navigation.named_tasks import facts_of, source_named

    if asked.resume is not None:
        return _resumed(asked.resume, asked.steps)
    name = asked.env or asked.task or _DEFAULT
    if asked.env is not None:
        source: dict[str, Any] = {"env": asked.env}
    else:
        given = {key: getattr(asked, key) for key in ("robot", "circles", "people", "sideways", "pace", "solver")}
        given["robot_config"] = None if asked.config is None else str(asked.config)
        source = facts_of(source_named(name, **given))
    changes = {key: getattr(asked, key) for key in NUMBERS if getattr(asked, key) is not None}
    config = replace(preset(name), **changes)
    seeds = asked.seeds or 1
    if seeds * config.batch > _BATCH:
        what = f"seeds x actors x horizon, {seeds * config.batch}, is out of range"
        raise BadInput(what, where=PROG, remedy=f"give up to {_BATCH}")
    return Job(name, source, config, asked.seed or 0, seeds, None)


def _resumed(folder: Path, steps: int | None) -> Job:
    """The run in a folder, to go on.

    Raises:
        BadInput: there is none, or it has come farther than it is to go.
    """
    from toddle.outside.navigation.training_files import read_figures, read_training

    (config, source), figures = read_training(folder), read_figures(folder)
    if steps is not None:
        made = int(figures["updates"]) * config.batch
        if steps < made:
            raise BadInput(f"the run has made {made} steps already", where=f"--steps {steps}", remedy="give more")
        config = replace(config, steps=steps)
    name = str(source.get("env") or source.get("task"))
    return Job(name, source, config, int(figures["seed"]), int(figures["seeds"]), folder)


def learned(asked: Ppo, job: Job) -> Learned:
    """Learn to the end, to trouble, or until somebody stops it.

    Raises:
        BadInput: the robot, the environment or the folder is of no use.
    """
    if "env" in job.source:
        return _learned_gym(asked, job)
    from toddle.outside.navigation.judging import judge, score
    from toddle.outside.navigation.named_tasks import make_task, source_from
    from toddle.outside.navigation.ppo_run import run

    if asked.devices is not None:
        _check_devices(asked.devices, job)
    task = make_task(source_from(job.source))

    def tried(policy: Policy, seed: int) -> dict[str, Any]:
        return judge(task, policy, seed, asked.episodes)

    def marked(policy: Policy) -> dict[str, Any]:
        figures = tried(policy, UNSEEN - 1)
        return {**figures, "score": score(figures)}

    with _going_on(asked, job) as (plan, told):
        return Learned(run(task, job.config, plan, judge=marked, **told), tried, plan.folder)


def _check_devices(devices: int, job: Job) -> None:
    """Refuse devices that are not there, or that can't share the actors."""
    import jax

    there = jax.device_count()
    if devices > there:
        raise BadInput(f"there are {there}", where=f"--devices {devices}", remedy=f"give 1 to {there}")
    if devices > 1 and (job.seeds > 1 or job.config.actors % devices):
        what = (
            "several seeds lie on one device" if job.seeds > 1 else f"{job.config.actors} actors can't be shared evenly"
        )
        raise BadInput(what, where=f"--devices {devices}", remedy="leave it out, or change --seeds and --actors")


def _learned_gym(asked: Ppo, job: Job) -> Learned:
    """The same on a Gymnasium environment, which is stepped on the host."""
    import jax

    from toddle.outside.navigation.gym_training import GymTraining
    from toddle.outside.navigation.judging import judge_gym
    from toddle.outside.navigation.ppo_run import run

    gym = GymTraining(job.name, job.config, anew_every=_saved_every(job.config))
    try:
        begun = gym.init(jax.random.key(job.seed))
        with _going_on(asked, job) as (plan, told):
            found = run(gym.copies.spaces, job.config, plan, advance=gym.advance, begun=begun, **told)
    finally:
        gym.close()
    return Learned(found, lambda policy, seed: judge_gym(job.name, policy, seed, asked.episodes), plan.folder)


@contextmanager
def _going_on(asked: Ppo, job: Job) -> Iterator[tuple[Plan, dict[str, Any]]]:
    """Where a run is kept, and who is told of it and may stop it."""
    from toddle.outside.files import write_json
    from toddle.outside.navigation.ppo_run import Plan
    from toddle.outside.terminal import Reporter, stoppable
    from toddle.outside.versions import versions

    config, total = job.config, job.config.updates * job.config.batch
    name = job.name.replace("/", "-")
    with left_folder(asked.out, name) if job.resumed is None else nullcontext(job.resumed) as folder:
        plan = Plan(
            folder, job.name, job.source, job.seed, job.seeds, _saved_every(config), max(config.updates // 8, 1),
            asked.devices or 1,
        )  # fmt: skip
        with stoppable() as stop, Reporter(f"{job.name}, steps", total, quiet=asked.json) as reporter:
            facts = {"source": dict(job.source), "seed": job.seed, "seeds": job.seeds, "ppo": asdict(config)}
            write_json(folder / "config.json", {**facts, "versions": versions()})
            yield plan, {"resume": job.resumed is not None, "reporter": reporter, "stop": stop}


def _saved_every(config: PpoConfig) -> int:
    return max(config.updates // 20, 1)
