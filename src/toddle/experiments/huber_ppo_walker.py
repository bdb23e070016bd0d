"""The walking pattern and PPO together (Huber 2019, section 4.3.2, figure 4.32): a policy steers the walker to goals.

The predictive controller runs in the loop, every iteration of it. First as the document did: one robot, an update
each 2,000 actions, minibatches of 200, five epochs of PPO, a learning rate of 0.003, c2 = -50, 50 epochs (--quick:
five). Its reward is that of `toddle.navigate.tasks.rewards.DOCUMENT`, divided by 600, and so is its c2. Then with our
numbers. What the document does not say: one action lasts 0.4 s (its sample), goals lie 0.5 to 3 m away in any
direction, and are reached within 0.2 m. In full, the policies that were trained on the pattern alone then walk the
robot in physics.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.presets import GOAL
from toddle.navigate.ppo.training import Report, Training, init, train, train_seeds
from toddle.navigate.scenarios.layouts import Layout
from toddle.navigate.task import Outcome as End
from toddle.navigate.tasks.rewards import DOCUMENT
from toddle.navigate.tasks.walker import WalkerTask
from toddle.outside.navigation.judging import walked
from toddle.outside.navigation.named_tasks import TASKS, facts_of, walker_task

PRINTED = 100.0
"""Goals reached of 100, in the document."""

BY_THE_LETTER = PpoConfig(
    steps=100_000, actors=1, horizon=2000, minibatch=200, epochs=5, epsilon=0.2, c1=0.5, c2=-50 / 600,
    learning_rate=3e-3, schedule="constant", hidden=(64, 64), activation="tanh", bound="mean",
    normalise_observations=False, normalise_rewards=False,
)  # fmt: skip
"""The document's numbers."""

GOALS = {"ahead": (2.0, 0.0), "beside": (0.0, 1.5), "behind, near": (-0.8, 0.0), "behind": (-1.5, -1.5)}
"""Of the four cases in the picture [m]; ours."""

_TRIAL = 2_000_000  # seeds of trials lie so far from those of training


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        seeds: runs by our numbers.
        letter: runs by the document's.
        epochs: of these, of 2,000 actions; the document's 50, or fewer.
        goals: of each trial, on the pattern.
        courses: of each trial in physics; 0: none.
    """

    seeds: int = 5
    letter: int = 5
    epochs: int = 50
    goals: int = 100
    courses: int = 100


FULL = Parameters()
QUICK = Parameters(seeds=1, letter=1, epochs=5, courses=0)


def run(task: Task) -> Outcome:
    """Both settings, each judged on goals that it never saw; in full, in physics as well."""
    parameters = FULL if task.full else QUICK
    if task.seeds is not None:
        parameters = replace(parameters, seeds=task.seeds, letter=min(task.seeds, parameters.letter))
    walking = walker_task(TASKS["goal"])
    letter = _by_the_letter(replace(walking, rewards=DOCUMENT), parameters, task.part(0.0, 0.3))
    ours, policies = _ours(walking, parameters, task.part(0.3, 0.5 if parameters.courses else 1.0))
    rows = [_row("by the document's numbers", letter), _row("by ours", ours)]
    rows.append(Row("by ours, the worst run", _least(ours), PRINTED, ""))
    rows.append(Row("by ours, training", _mean(ours, "train_seconds"), None, "s"))
    rows.append(Row("by ours, seconds to a goal", _mean(ours, "seconds_mean"), None, "s"))
    _draw(walking, policies, task.folder)
    figures: dict[str, Any] = {"document": letter, "ours": ours}
    if parameters.courses and policies and not task.stopped():
        physics = _in_physics(policies, parameters, task.part(0.5, 1.0))
        figures["physics"] = physics
        rows.append(Row("in physics, of 100", 100 * float(np.mean([one["success_rate"] for one in physics])), None, ""))
        rows.append(Row("in physics, the worst run, of 100", 100 * min(one["success_rate"] for one in physics)))
        rows.append(Row("in physics, falls", float(sum(one["falls"] for one in physics))))
    reached = [one["wins"] for one in ours]
    verdict = (
        f"{min(reached, default=0)} to {max(reached, default=0)} of {parameters.goals} goals in {len(reached)} runs, "
        f"{PRINTED:.0f} of 100 printed; trained in {_mean(ours, 'train_seconds'):.0f} s"
    )
    return Outcome(tuple(rows), verdict, bool(reached) and min(reached) == parameters.goals, parameters, figures)


def _by_the_letter(walking: WalkerTask, parameters: Parameters, task: Task) -> list[dict[str, Any]]:
    """Runs side by side: one robot each, as there."""
    config = replace(BY_THE_LETTER, steps=parameters.epochs * BY_THE_LETTER.batch)
    keys = jax.vmap(jax.random.key)(task.seed + jnp.arange(parameters.letter))
    trainings = jax.jit(jax.vmap(lambda key: init(walking, config, key)))(keys)
    began, done = time.perf_counter(), 0
    while done < config.updates and not task.stopped():
        trainings, _ = train_seeds(walking, config, trainings, 1)
        done += 1
        task.tell(done / config.updates, f"the document's numbers, epoch {done}")
    jax.block_until_ready(trainings)
    seconds = time.perf_counter() - began
    found = []
    for number in range(parameters.letter):
        training: Training = jax.tree.map(lambda part, number=number: part[number], trainings)
        policy = policy_of(training, config, walking.actions)
        found.append({"seed": task.seed + number, "steps": done * config.batch, "train_seconds": seconds}
                     | walked(walking, policy, _TRIAL + task.seed + number, parameters.goals))  # fmt: skip
    return found


def _ours(walking: WalkerTask, parameters: Parameters, task: Task) -> tuple[list[dict[str, Any]], list[Policy]]:
    """One run after the other, so that each is timed alone; compiling is not counted."""
    config, chunk, found, policies = GOAL, 4, [], []
    start = jax.jit(init, static_argnums=(0, 1))
    training = start(walking, config, jax.random.key(task.seed))
    began = time.perf_counter()
    jax.block_until_ready(train(walking, config, training, chunk))
    compiling = time.perf_counter() - began
    for number in range(parameters.seeds):
        if task.stopped():
            break
        training, reports = start(walking, config, jax.random.key(task.seed + number)), []
        began = time.perf_counter()
        while len(reports) * chunk < config.updates and not task.stopped():
            training, report = train(walking, config, training, chunk)
            reports.append(report)
            share = len(reports) * chunk / config.updates
            task.tell((number + share) / parameters.seeds, f"run {number + 1}, {_news(report)}")
        seconds, steps = time.perf_counter() - began, len(reports) * chunk * config.batch
        policy = policy_of(training, config, walking.actions, facts_of(TASKS["goal"]))
        judged = walked(walking, policy, _TRIAL + task.seed + number, parameters.goals)
        found.append({"env": "goal", "seed": task.seed + number, "steps": steps, "train_seconds": seconds,
                      "compile_seconds": compiling, "steps_per_second": steps / seconds} | judged)  # fmt: skip
        policies.append(policy)
    return found, policies


def _news(report: Report) -> str:
    ended = int(np.asarray(report.outcomes)[:, 1:].sum())
    won = int(np.asarray(report.outcomes)[:, End.WON].sum())
    return f"{won} of {ended} goals reached while learning"


def _in_physics(policies: list[Policy], parameters: Parameters, task: Task) -> list[dict[str, Any]]:
    """Each policy on the robot, without having been retrained."""
    from toddle.navigate.scenarios.layouts import layouts
    from toddle.outside.navigation.course import courses_of, summary
    from toddle.outside.navigation.physics_batch import Recipe, run_courses
    from toddle.outside.navigation.policy_files import save_policy
    from toddle.outside.navigation.steered import learned

    found = []
    for number, policy in enumerate(policies):
        if task.stopped():
            break
        folder = task.folder / f"policy-{task.seed + number}"
        save_policy(policy, folder)
        courses, done = courses_of(layouts(_TRIAL + task.seed + number, parameters.courses, circles=0)), [0]

        def told(_: int, __: Any, number: int = number, done: list[int] = done) -> None:
            done[0] += 1
            share = (number + done[0] / parameters.courses) / len(policies)
            task.tell(share, f"in physics: run {number + 1}, {done[0]} of {parameters.courses}")

        finishes = run_courses(Recipe(learned, (folder,)), courses, progress=told, stopped=task.stopped)
        found.append({"seed": task.seed + number} | summary([one for one in finishes if one is not None]))
    return found


def _draw(walking: WalkerTask, policies: list[Policy], folder: Path) -> None:
    """Four cases seen from above (figure 4.32)."""
    from toddle.outside.navigation.course import Course, Finish, path_length
    from toddle.outside.navigation.course_pictures import cases

    if not policies:
        return
    courses, finishes = [], []
    for goal in GOALS.values():
        path, end = walk_path(walking, policies[0], goal)
        shortest = math.hypot(*goal) - walking.near
        length = path_length(path, 0.4)
        courses.append(Course(goal))
        finishes.append(Finish(end, float(path[-1, 0]), path, (), length, shortest, 1.0, math.nan))
    cases(folder / "figure-4-32.png", courses, finishes, title="figure 4.32: goals by PPO on the walking pattern")


def walk_path(walking: WalkerTask, policy: Policy, goal: tuple[float, float]) -> tuple[np.ndarray, End]:
    """Where the policy walks: time [s], x, y [m], yaw [rad] after each action; and how it ended."""
    state, seen = walking.begin(Layout(jnp.asarray(goal, jnp.float32), jnp.zeros((0, 3))), jax.random.key(0))
    step, memory, path, end = jax.jit(walking.step), policy.start(), [(0.0, 0.0, 0.0, 0.0)], End.GOES_ON
    while end == End.GOES_ON:
        action, memory = policy(seen, memory)
        state, found = step(state, action, jax.random.key(0))
        seen, end = found.observation, End(int(found.outcome))
        x, y, yaw = np.asarray(state.place).astype(float).tolist()
        path.append((len(path) * walking.dt, x, y, yaw))
    return np.array(path), end


def _row(what: str, runs: list[dict[str, Any]]) -> Row:
    share = float(np.mean([one["success_rate"] for one in runs])) if runs else None
    return Row(f"{what}, goals of 100, mean of {len(runs)} runs", None if share is None else 100 * share, PRINTED, "")


def _least(runs: list[dict[str, Any]]) -> float | None:
    return min((100 * one["success_rate"] for one in runs), default=None)


def _mean(runs: list[dict[str, Any]], name: str) -> float:
    return float(np.mean([one[name] for one in runs])) if runs else math.nan


EXPERIMENT = Experiment("huber-ppo-walker", "Huber 2019, section 4.3.2 and figure 4.32", run)
