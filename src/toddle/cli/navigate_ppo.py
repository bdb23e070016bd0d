"""``toddle navigate ppo``: a policy learns by proximal policy optimization, and is judged on what it never saw."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.navigate.policy import Policy
    from toddle.navigate.ppo.config import PpoConfig
    from toddle.outside.navigation.ppo_run import Run

_PROG = "toddle navigate ppo"
_DEFAULT = "goal"
_STOPPED = 130
_UNSEEN = 1_000_000  # seeds of trials lie so far from those of training
_TASKS = ("robot", "config", "circles", "people", "sideways", "pace", "solver")
_NUMBERS = (
    "steps", "actors", "horizon", "minibatch", "epochs", "gamma", "lambda_", "epsilon", "c1", "c2", "learning_rate",
    "schedule", "kl_limit", "hidden", "activation", "memory", "sequence", "bound", "deviation",
)  # fmt: skip
_LARGEST = 2**40


@dataclass(frozen=True)
class Ppo:
    """A policy learns by trial and error: proximal policy optimization.

    toddle navigate ppo teaches the humanoid to walk to goals; the real predictive controller runs in the loop, every
    iteration of it. A run leaves a folder with the policy, checkpoints, the learning curve, figures, and files for
    TensorBoard. Ctrl-C ends it with what it has; --resume goes on bit for bit. The exit code is 1 where it diverged.

    Attributes:
        task: point (the document's benchmark), goal (the walking robot), obstacles, people; goal unless given.
        env: the id of a Gymnasium environment, such as Pendulum-v1, instead of a task.
        robot: who walks: a name (heicub, icub), the path of a humanoid's description, or unicycle.
        config: a TOML file that says what a humanoid's description leaves out.
        circles: at most so many obstacles.
        people: so many walk around.
        sideways: let it walk aside as well: a third action.
        pace: greatest velocity, as a share of the robot's; 0.8 unless given.
        solver: of the walking pattern: native (this machine's cores), batch (accelerators) or auto.
        seed: of all randomness.
        seeds: so many runs side by side, each with the next seed.
        steps: to train for.
        actors: copies of the task side by side (N).
        horizon: steps of each between two updates (T).
        minibatch: transitions of a gradient step (M).
        epochs: passes over what was collected (K).
        gamma: discount.
        lambda_: of generalised advantage estimation.
        epsilon: of the clipped objective.
        c1: weight of the value loss.
        c2: weight of the entropy.
        learning_rate: of Adam.
        schedule: of the learning rate: constant or linear.
        kl_limit: an update ends early once policies differ by more.
        hidden: units of the hidden layers.
        activation: of the hidden layers: tanh or relu.
        memory: units of a recurrent layer.
        sequence: steps that gradients go back through it.
        bound: how actions are kept in range: clip, tanh or mean.
        deviation: of the actions at the start.
        episodes: of the trial at the end.
        resume: go on with the run in this folder.
        out: the folder to leave; runs/TASK unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    task: Annotated[str | None, POSITIONAL] = None
    env: str | None = None
    robot: str | None = None
    config: Path | None = None
    circles: int | None = None
    people: int | None = None
    sideways: bool | None = None
    pace: float | None = None
    solver: Literal["native", "batch", "auto"] | None = None
    seed: int = 0
    seeds: int = 1
    steps: int | None = None
    actors: int | None = None
    horizon: int | None = None
    minibatch: int | None = None
    epochs: int | None = None
    gamma: float | None = None
    lambda_: float | None = None
    epsilon: float | None = None
    c1: float | None = None
    c2: float | None = None
    learning_rate: float | None = None
    schedule: Literal["constant", "linear"] | None = None
    kl_limit: float | None = None
    hidden: tuple[int, ...] | None = None
    activation: Literal["tanh", "relu"] | None = None
    memory: int | None = None
    sequence: int | None = None
    bound: Literal["clip", "tanh", "mean"] | None = None
    deviation: float | None = None
    episodes: int = 100
    resume: Path | None = None
    out: Path | None = None
    json: bool = False


class Job(NamedTuple):
    """What is to be learned, and how.

    Attributes:
        name: of the task or the environment.
        source: how the task is made again.
        config: of the learning.
        folder: of the run.
        resumed: the run in the folder goes on.
    """

    name: str
    source: Mapping[str, Any]
    config: PpoConfig
    folder: Path
    resumed: bool


def main(argv: Sequence[str]) -> int:
    """Learn, judge, leave a folder; returns the exit code."""
    asked = parse(Ppo, argv, prog=_PROG)
    _check(asked)
    from toddle.cli.navigate_evaluate import tell
    from toddle.outside.files import write_json
    from toddle.outside.navigation.learning_pictures import learning_curve
    from toddle.outside.versions import versions

    job = _job(asked)
    began = time.perf_counter()
    run, judge = _learned(asked, job)
    seconds = time.perf_counter() - began
    figures = _figures(run, judge, asked, seconds)
    facts = {"source": dict(job.source), "seed": asked.seed, "seeds": asked.seeds, "versions": versions()}
    write_json(job.folder / "config.json", facts)
    write_json(job.folder / "figures.json", figures)
    if run.history:
        learning_curve(job.folder / "learning.png", run.history, title=f"{job.name}: learning")
    tell(figures, job.folder, as_json=asked.json)
    if run.stopped is not None:
        print(f"toddle: {job.name}: {run.stopped}; {_remedy(run, job)}", file=sys.stderr)
    return 1 if run.diverged else _STOPPED if run.stopped else 0


def _check(asked: Ppo) -> None:
    """Refuse what contradicts itself or is out of range before anything heavy is imported."""
    if asked.task is not None and asked.env is not None:
        raise BadInput(f"--env and {asked.task} exclude each other", where=_PROG, remedy="give one")
    if asked.env is not None and (useless := [name for name in _TASKS if getattr(asked, name) is not None]):
        raise BadInput("a Gymnasium environment knows no such thing", where=f"--{useless[0]}", remedy="leave it out")
    if asked.env is not None and asked.seeds > 1:
        raise BadInput("an environment is learned one seed at a time", where="--seeds", remedy="leave it out")
    for name in ("steps", "actors", "horizon", "minibatch", "epochs", "memory", "sequence", "episodes", "seeds"):
        value = getattr(asked, name)
        least = 0 if name == "memory" else 1
        if value is not None and not least <= value <= _LARGEST:
            raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=f"give {least} or more")
    if not 0 <= asked.seed < _UNSEEN:
        raise BadInput(f"{asked.seed} is out of range", where="--seed", remedy=f"give 0 to {_UNSEEN - 1}")
    if asked.resume is None:
        if asked.out is not None and (asked.out / "checkpoint.json").exists():
            remedy = f"go on with --resume {asked.out}, or name another"
            raise BadInput("it holds a run already", where=f"--out {asked.out}", remedy=remedy)
        return
    given = [name for name in ("task", "env", "out", *_TASKS, *_NUMBERS) if getattr(asked, name) is not None]
    given = [name for name in given if name != "steps"]
    if given:
        flag = given[0] if given[0] == "task" else f"--{given[0].rstrip('_').replace('_', '-')}"
        raise BadInput(f"{flag} can't be changed in a run that goes on", where=_PROG, remedy="leave it out")


def _job(asked: Ppo) -> Job:
    from toddle.cli.run_folder import new_folder
    from toddle.navigate.ppo.presets import preset
    from toddle.outside.navigation.named_tasks import facts_of, source_named
    from toddle.outside.navigation.training_files import read_training

    if asked.resume is not None:
        config, source = read_training(asked.resume)
        if asked.steps is not None:
            config = replace(config, steps=asked.steps)
        return Job(str(source.get("env") or source.get("task")), source, config, asked.resume, True)
    name = asked.env or asked.task or _DEFAULT
    if asked.env is not None:
        source: dict[str, Any] = {"env": asked.env}
    else:
        given = {key: getattr(asked, key) for key in ("robot", "circles", "people", "sideways", "pace", "solver")}
        given["robot_config"] = None if asked.config is None else str(asked.config)
        source = facts_of(source_named(name, **given))
    changes = {key: getattr(asked, key) for key in _NUMBERS if getattr(asked, key) is not None}
    config = replace(preset(name), **changes)
    return Job(name, source, config, new_folder(asked.out, name.replace("/", "-")), False)


def _learned(asked: Ppo, job: Job) -> tuple[Run, Callable[[Policy, int], dict[str, Any]]]:
    """The run, and what judges its policies."""
    import jax

    from toddle.outside.navigation.gym_training import GymTraining
    from toddle.outside.navigation.judging import judge, judge_gym, score
    from toddle.outside.navigation.named_tasks import make_task, source_from
    from toddle.outside.navigation.ppo_run import Plan, run
    from toddle.outside.terminal import Reporter, stoppable

    updates = job.config.updates
    saved, judged = max(updates // 20, 1), max(updates // 8, 1)
    plan = Plan(job.folder, job.name, job.source, asked.seed, asked.seeds, saved, judged)
    with stoppable() as stop, Reporter(f"{job.name}, steps", job.config.steps, quiet=asked.json) as reporter:
        if "env" in job.source:
            gym = GymTraining(job.name, job.config, anew_every=saved)
            try:
                begun = gym.init(jax.random.key(asked.seed))
                found = run(
                    gym.copies.spaces, job.config, plan, advance=gym.advance, begun=begun, resume=job.resumed,
                    reporter=reporter, stop=stop,
                )  # fmt: skip
            finally:
                gym.close()
            return found, lambda policy, seed: judge_gym(job.name, policy, seed, asked.episodes)
        task = make_task(source_from(job.source))

        def tried(policy: Policy, seed: int) -> dict[str, Any]:
            return judge(task, policy, seed, asked.episodes)

        def marked(policy: Policy) -> dict[str, Any]:
            figures = tried(policy, _UNSEEN - 1)
            return {**figures, "score": score(figures)}

        found = run(task, job.config, plan, judge=marked, resume=job.resumed, reporter=reporter, stop=stop)
    return found, tried


def _figures(run: Run, judge: Callable[[Policy, int], dict[str, Any]], asked: Ppo, seconds: float) -> dict[str, Any]:
    """Of the run and, on starts that neither training nor its trials saw, of what it learned."""
    told = {name: value for name, value in run.figures.items() if name not in ("marks", "judged", "troubles")}
    told["wall_seconds"] = seconds
    found = [judge(policy, _UNSEEN + asked.seed + number) for number, policy in enumerate(run.policies)]
    told |= found[0]
    if len(found) > 1:
        told["each_seed"] = found
    return told


def _remedy(run: Run, job: Job) -> str:
    if run.diverged:
        return f"the last good policy and checkpoint are in {job.folder}"
    return f"go on with --resume {job.folder}"
