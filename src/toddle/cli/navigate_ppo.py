"""``toddle navigate ppo``: a policy learns by proximal policy optimization, and is judged on what it never saw."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from toddle.cli.arguments import parse
from toddle.cli.navigate_folder import RUN, refuse_used
from toddle.cli.navigate_learning import NUMBERS, PROG, UNSEEN, job_of, learned
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.navigate.policy import Policy
    from toddle.outside.navigation.ppo_run import Run

_STOPPED = 130
_TASKS = ("robot", "config", "circles", "people", "sideways", "pace", "solver")
_MOST = {
    "steps": 2**40, "actors": 2**20, "horizon": 2**20, "minibatch": 2**24, "epochs": 1000, "memory": 4096,
    "sequence": 2**20, "episodes": 100_000, "seeds": 256, "seed": UNSEEN - 1, "devices": 4096,
}  # fmt: skip
_WIDEST = 2**14  # layer


@dataclass(frozen=True)
class Ppo:
    """A policy learns by trial and error: proximal policy optimization.

    toddle navigate ppo teaches the humanoid to walk to goals; the real predictive controller runs in the loop, every
    iteration of it. A run leaves a folder with the policy, checkpoints, the learning curve, figures, and files for
    TensorBoard. Ctrl-C ends it with what it has; --resume goes on bit for bit, where Gymnasium's environments
    begin anew. The exit code is 1 where it diverged.

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
        seed: of all randomness; 0 unless given.
        seeds: so many runs side by side, each with the next seed; 1 unless given.
        devices: so many share the actors, such as several graphics cards.
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
    seed: int | None = None
    seeds: int | None = None
    devices: int | None = None
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


def main(argv: Sequence[str]) -> int:
    """Learn, judge, leave a folder; returns the exit code."""
    asked = parse(Ppo, argv, prog=PROG)
    _check(asked)
    from toddle.cli.navigate_evaluate import tell
    from toddle.outside.files import write_json
    from toddle.outside.navigation.learning_pictures import learning_curve

    job = job_of(asked)
    began = time.perf_counter()
    run, judge, folder = learned(asked, job)
    if run.history:
        learning_curve(folder / "learning.png", run.history, title=f"{job.name}: learning")
    figures = _figures(run, judge, job.seed)
    figures["wall_seconds"] = time.perf_counter() - began
    write_json(folder / "figures.json", figures)
    tell(figures, folder, as_json=asked.json)
    if run.stopped is not None:
        print(f"toddle: {job.name}: {run.stopped}; {_remedy(run, folder)}", file=sys.stderr)
    return 1 if run.diverged else _STOPPED if run.stopped else 0


def _check(asked: Ppo) -> None:
    """Refuse what contradicts itself or is out of range before anything heavy is imported."""
    if asked.task is not None and asked.env is not None:
        raise BadInput(f"--env and {asked.task} exclude each other", where=PROG, remedy="give one")
    if asked.env is not None and (useless := [name for name in _TASKS if getattr(asked, name) is not None]):
        raise BadInput("a Gymnasium environment knows no such thing", where=f"--{useless[0]}", remedy="leave it out")
    if asked.env is not None and (asked.seeds or 1) > 1:
        raise BadInput("an environment is learned one seed at a time", where="--seeds", remedy="leave it out")
    if asked.env is not None and asked.devices is not None:
        raise BadInput("an environment is stepped on the host", where="--devices", remedy="leave it out")
    for name, most in _MOST.items():
        value, least = getattr(asked, name), 0 if name in ("memory", "seed") else 1
        if value is not None and not least <= value <= most:
            raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=f"give {least} to {most}")
    if wrong := [units for units in asked.hidden or () if not 1 <= units <= _WIDEST]:
        raise BadInput(f"{wrong[0]} is out of range", where="--hidden", remedy=f"give 1 to {_WIDEST}")
    if asked.resume is None:
        refuse_used(asked.out)
        return
    given = [
        name for name in ("task", "env", "out", "seed", "seeds", *_TASKS, *NUMBERS) if getattr(asked, name) is not None
    ]
    given = [name for name in given if name != "steps"]
    if given:
        flag = given[0] if given[0] == "task" else f"--{given[0].rstrip('_').replace('_', '-')}"
        raise BadInput(f"{flag} can't be changed in a run that goes on", where=PROG, remedy="leave it out")


def _figures(run: Run, judge: Callable[[Policy, int], dict[str, Any]], seed: int) -> dict[str, Any]:
    """Of the run and, on starts that neither training nor its trials saw, of what it learned.

    Who stopped it is not kept waiting for another trial: the best one while it learned is told instead.
    """
    told = dict(run.figures)
    if run.stopped is not None and not run.diverged:
        return told
    left_out = ("marks", "judged", "troubles") if not run.diverged else ("marks", "judged")
    told = {name: value for name, value in told.items() if name not in left_out}
    found = [judge(policy, UNSEEN + seed + number) for number, policy in enumerate(run.policies)]
    return told | (found[0] if len(found) == 1 else {**_over_seeds(found), "each_seed": found})


def _over_seeds(found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means over seeds; of what is a least or a lower end, the least."""
    return {
        name: min(one[name] for one in found)
        if name.endswith(("_least", "_low"))
        else sum(one[name] for one in found) / len(found)
        for name in found[0]
    }


def _remedy(run: Run, folder: Path) -> str:
    if run.diverged:
        kept = "policy and checkpoint are" if (folder / RUN).exists() else "policy is"
        return f"the last good {kept} in {folder}"
    return f"go on with {PROG} --resume {folder}"
