"""The point that walks to a goal: proximal policy optimization on its benchmark (Huber 2019, section 4.3.1).

Learned thrice, seeds side by side: with the document's numbers by the letter, with these as the author's published
program (github.com/mhubii/ppo_libtorch) takes them, and with ours. Then the document's test:
ten runs of 10,000 steps without noise. As there are 121 goals and nothing is drawn but them, a policy is also judged
on each goal once, from which follow its exact rate of wins and, for the best possible walk, the ceiling of all rates.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.navigate import task as tasks
from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.collect import begin, collect
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.presets import preset
from toddle.navigate.ppo.training import Report, Training, init, train_seeds
from toddle.navigate.tasks.point import PointState, PointTask
from toddle.navigate.trial import tally

WINS, WINS_SPREAD, LOSSES, EPOCHS_TO_LEARN = 311.0, 3.0, 0.0, 30.0
"""What the document prints, of ten runs of `TEST_STEPS`; its figure 4.30 says 20 epochs, its text 30."""
EPOCH, TEST_STEPS = 10_000, 10_000
DOCUMENT = PpoConfig(
    steps=500_000,
    actors=1,
    horizon=4096,
    minibatch=512,
    epochs=8,
    c2=0.1,
    c2_over_reward=True,
    learning_rate=0.01,
    schedule="constant",
    gradient_norm=1e9,
    hidden=(16, 32),
    activation="relu",
    bound="mean",
    normalise_observations=False,
    normalise_rewards=False,
    normalise_advantages=False,
)
"""By the letter; where the mean reward is small or below zero, c2 is divided by 0.1."""
PROGRAM = replace(DOCUMENT, epochs=1)
"""The author's published program makes one step of 512 actions in each of the 8 "epochs": 8 steps an update, not 64."""


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        seeds: runs of each kind.
        fresh: more runs with our numbers, on seeds that these were not chosen by.
        document: the document's numbers, by the letter.
        program: the same, as the author's program reads them; it keeps the networks of the best epoch.
        ours: our numbers.
        tests: runs of `TEST_STEPS` in the test of a policy.
        near: a goal is reached nearer than this.
    """

    seeds: int
    fresh: int
    document: PpoConfig
    program: PpoConfig
    ours: PpoConfig
    tests: int = 10
    near: float = 0.6


FULL = Parameters(seeds=10, fresh=30, document=DOCUMENT, program=PROGRAM, ours=preset("point"))
QUICK = replace(
    FULL, seeds=3, fresh=0, document=replace(DOCUMENT, steps=50_000), program=replace(PROGRAM, steps=150_000)
)


class Games(NamedTuple):
    """One game for each goal, without noise.

    Attributes:
        outcome: see `toddle.navigate.task.Outcome`; goes on: not over after all steps.
        length: in steps.
        seen: the point and its goal after each step; after the end, of no meaning.
    """

    outcome: Int[Array, " goals"]
    length: Int[Array, " goals"]
    seen: Float[Array, "steps goals 4"]

    @property
    def won(self) -> Array:
        """Whether each was won."""
        return self.outcome == tasks.Outcome.WON

    @property
    def rate(self) -> Array:
        """Wins expected in `TEST_STEPS` steps; 0 where a goal is not reached, as the test would be stuck there."""
        return jnp.where(self.won.all(), TEST_STEPS / self.length.mean(), 0.0)


def every_goal(point: PointTask, act: Callable[[Array], Array], most: int = 200) -> Games:
    """A game for each goal there is, of so many steps at most.

    Args:
        point: the task.
        act: from what is seen to the action, of one game.
        most: steps.
    """
    along = jnp.arange(-point.widest, point.widest + 1, dtype=jnp.float32)
    goals = jnp.stack(jnp.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)

    def step(state: PointState, _: None) -> tuple:
        seen = jnp.concatenate([state.agent, state.goal], axis=-1)
        state, made = jax.vmap(lambda one, action: point.step(one, action, jax.random.key(0)))(
            state, jax.vmap(act)(seen)
        )
        return state, (made.outcome, made.observation)

    start = PointState(jnp.zeros_like(goals), goals, jnp.zeros(len(goals), jnp.int32))
    _, (outcome, seen) = jax.lax.scan(step, start, length=most)
    over = outcome != tasks.Outcome.GOES_ON
    last = jnp.where(over.any(axis=0), over.argmax(axis=0), most - 1)
    return Games(jnp.take_along_axis(outcome, last[None], axis=0)[0], (last + 1).astype(jnp.int32), seen)


def best_walk(point: PointTask) -> Games:
    """The shortest: full strides along both axes, the last as long as it must be. No policy within bounds is faster."""
    return every_goal(point, lambda seen: jnp.clip((seen[2:] - seen[:2]) / point.stride, -1.0, 1.0))


class Learned(NamedTuple):
    """Runs side by side.

    Attributes:
        config: what they learned with.
        seeds: theirs.
        runs: at the end, or after the epoch of most reward; each part with a leading axis of seeds.
        early: the same after the first epoch.
        report: of each update, with leading axes of seeds and updates.
        rates: exact rate of wins without noise, tested about each epoch.
        compile_seconds: before it began [s].
        seconds: of computing until each of these tests, without the tests, all runs together [s].
        cpu_seconds: in the end, of all cores [s].
    """

    config: PpoConfig
    seeds: tuple[int, ...]
    runs: Training
    early: Training
    report: Report
    rates: Float[np.ndarray, "seeds tests"]
    compile_seconds: float
    seconds: Float[np.ndarray, " tests"]
    cpu_seconds: float

    def policy(self, number: int) -> Policy:
        """What one of them has learned."""
        run = jax.tree.map(lambda part: part[number], self.runs)
        return policy_of(run, self.config, PointTask().actions)

    def solved_at(self) -> list[int | None]:
        """The test at which each run first had the document's wins; None: at none."""
        return [int(good.argmax()) if good.any() else None for good in self.rates >= WINS]

    def steps_at(self, number: int) -> int:
        """Steps of a run until a test."""
        return int(self.report.steps[0, -1]) * (number + 1) // len(self.seconds)


def learned(task: Task, point: PointTask, config: PpoConfig, seeds: tuple[int, ...], best: bool = False) -> Learned:
    """Learn with some numbers from each seed; keep what there is at the end, or after the epoch of most reward."""
    updates = max(1, round(EPOCH / config.batch))
    keys = jnp.stack([jax.random.key(seed) for seed in seeds])
    runs = jax.jit(jax.vmap(partial(init, point, config)))(keys)
    began = time.perf_counter()
    go = train_seeds.lower(point, config, runs, updates).compile()
    rates_of = jax.jit(jax.vmap(lambda run: every_goal(point, _actor(config, run)).rate)).lower(runs).compile()
    compiled = time.perf_counter() - began
    early, kept, most, parts, cpu = runs, runs, np.full(len(seeds), -np.inf), -(-config.updates // updates), 0.0
    reports, rates, seconds = [], [], []
    for number in range(parts):
        if task.stopped() and reports:
            break
        task.tell(number / parts, f"{len(seeds)} seeds, {number * updates * config.batch:,} steps each")
        began, began_cpu = time.perf_counter(), time.process_time()
        runs, report = jax.block_until_ready(go(runs))
        seconds.append(time.perf_counter() - began)
        cpu += time.process_time() - began_cpu
        early = early if number else runs
        reward = np.asarray(report.reward).mean(axis=1)
        kept, most = _chosen(reward > most, runs, kept), np.maximum(reward, most)
        reports.append(report)
        rates.append(np.asarray(rates_of(runs)))
    together = jax.tree.map(lambda *part: np.concatenate(part, axis=1), *reports)
    return Learned(
        config,
        seeds,
        kept if best else runs,
        early,
        together,
        np.stack(rates, axis=1),
        compiled,
        np.cumsum(seconds),
        cpu,
    )


def _chosen(which: Bool[np.ndarray, " seeds"], one: Training, other: Training) -> Training:
    """For each run what it is in one or the other; random keys, which aren't tested, as in the one."""

    def choose(a: Array, b: Array) -> Array:
        if jnp.issubdtype(a.dtype, jax.dtypes.prng_key):
            return a
        return jnp.where(which.reshape(which.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)


def _actor(config: PpoConfig, run: Training) -> Callable[[Array], Array]:
    policy = policy_of(run, config, PointTask().actions)
    return lambda seen: policy(seen, policy.start())[0]


class Tested(NamedTuple):
    """The document's test of each run: means and the least of the runs of `TEST_STEPS`, and each goal once.

    Attributes:
        wins, losses: of each seed and test run.
        total: sum of rewards of each.
        games: each goal once, of each seed.
    """

    wins: Int[np.ndarray, "seeds tests"]
    losses: Int[np.ndarray, "seeds tests"]
    total: Float[np.ndarray, "seeds tests"]
    games: tuple[Games, ...]

    def solved(self) -> int:
        """Seeds with at least the document's wins and no loss."""
        return int(((self.wins.mean(axis=1) >= WINS) & (self.losses.sum(axis=1) == 0)).sum())


def tested(point: PointTask, found: Learned, tests: int) -> Tested:
    """Without noise. What is drawn differs from what was learned on."""
    wins, losses, total, games = [], [], [], []
    play = jax.jit(lambda run: every_goal(point, _actor(found.config, run)))
    for number, seed in enumerate(found.seeds):
        policy = found.policy(number)
        drawn = jax.random.fold_in(jax.random.key(seed), 1)
        counted = tally(point, policy, drawn, tests, TEST_STEPS)
        wins.append(np.asarray(counted.outcomes[:, tasks.Outcome.WON]))
        losses.append(np.asarray(counted.outcomes[:, tasks.Outcome.LOST]))
        total.append(np.asarray(counted.total))
        games.append(play(jax.tree.map(lambda part: part[number], found.runs)))  # noqa: B023
    return Tested(np.stack(wins), np.stack(losses), np.stack(total), tuple(games))


def run(task: Task) -> Outcome:
    """Both kinds, the test, fresh seeds, one run alone against the clock, and the pictures."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    point = PointTask(near=parameters.near)
    seeds = tuple(range(task.seed, task.seed + parameters.seeds))
    fresh = tuple(range(task.seed + 1000, task.seed + 1000 + parameters.fresh))
    asked = {
        "ours": (parameters.ours, seeds, (0.0, 0.2)),
        "document": (parameters.document, seeds, (0.2, 0.5)),
        "program": (parameters.program, seeds, (0.5, 0.6)),
        "fresh": (parameters.ours, fresh, (0.6, 0.95)),
        "alone": (parameters.ours, seeds[:1], (0.95, 1.0)),
    }
    found: dict[str, tuple[Learned, Tested]] = {}
    for name, (config, those, share) in asked.items():
        if those and not (task.stopped() and found):
            done = learned(task.part(*share), point, config, those, best=name == "program")
            found[name] = (done, tested(point, done, parameters.tests))
    draw(task, point, found)
    ceiling = float(best_walk(point).rate)
    rows = [row for name, one in found.items() for row in _rows(name, *one)]
    rows.append(Row("the best possible, wins", ceiling))
    figures = {"ceiling": ceiling, **{name: _figures(*one) for name, one in found.items()}}
    count, good = len(seeds), {name: test.solved() for name, (_, test) in found.items()}
    holds = good.get("ours") == count and good.get("fresh", 0) == len(fresh)
    verdict = (
        f"at least {WINS:g} wins and no loss with our numbers: {good.get('ours', 0)} of {count} seeds and "
        f"{good.get('fresh', 0)} of {len(fresh)} fresh ones; with the document's by the letter "
        f"{good.get('document', 0)} of {count}, as its program reads them {good.get('program', 0)}; "
        f"the best possible is {ceiling:.1f} wins"
    )
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


_KINDS = {
    "document": "document's numbers, by the letter",
    "program": "document's numbers, as its program",
    "ours": "our numbers",
    "fresh": "our numbers, fresh seeds",
    "alone": "one run alone",
}


def _rows(name: str, found: Learned, test: Tested) -> list[Row]:
    """Of one kind, beside what is printed."""
    kind = _KINDS[name]
    solved = [at for at in found.solved_at() if at is not None]
    epochs = [found.steps_at(at) / EPOCH for at in solved]
    speed = len(found.seeds) * int(found.report.steps[0, -1]) / found.cpu_seconds
    if name == "alone":
        seconds = float(found.seconds[solved[0]]) if solved else None
        return [
            Row(f"{kind}: computing until first solved", seconds, None, "s"),
            Row(f"{kind}: compiling", found.compile_seconds, None, "s"),
            Row(f"{kind}: steps in a second of a core", speed),
        ]
    means = test.wins.mean(axis=1)
    return [
        Row(f"{kind}: wins in {TEST_STEPS:,} steps, mean of {means.size} seeds", float(means.mean()), WINS),
        Row(f"{kind}: the same, seed with the fewest", float(means.min())),
        Row(f"{kind}: the same, fewest in one run", float(test.wins.min())),
        Row(f"{kind}: deviation between a seed's runs", float(test.wins.std(axis=1).mean()), WINS_SPREAD),
        Row(f"{kind}: losses", float(test.losses.mean()), LOSSES),
        Row(f"{kind}: seeds with {WINS:g} wins and no loss", float(test.solved())),
        Row(f"{kind}: epochs until first solved, median of the seeds that were",
            float(np.median(epochs)) if epochs else None, EPOCHS_TO_LEARN),
        Row(f"{kind}: the same, slowest", max(epochs, default=None)),
        Row(f"{kind}: standard deviation of actions in the end", float(found.report.deviation[:, -1].mean())),
    ]  # fmt: skip


def _figures(found: Learned, test: Tested) -> dict[str, Any]:
    """All of one kind, for the JSON file; seconds of all its runs together."""
    steps = int(found.report.steps[0, -1])
    runs = [
        {
            "env": "point", "seed": seed, "steps": steps,
            "success_rate": float(np.asarray(games.won).mean()), "wins": float(test.wins[k].mean()),
            "losses": float(test.losses[k].mean()), "least_wins": int(test.wins[k].min()),
            "return_mean": float(test.total[k].sum() / max(1, test.wins[k].sum() + test.losses[k].sum())),
            "exact_wins": float(games.rate),
            "least_exact_wins_in_second_half": float(found.rates[k, len(found.seconds) // 2 :].min()),
            "solved_at_steps": None if at is None else found.steps_at(at),
        }
        for k, (seed, games, at) in enumerate(zip(found.seeds, test.games, found.solved_at(), strict=True))
    ]  # fmt: skip
    seconds = float(found.seconds[-1])
    return {
        "runs": runs, "train_seconds": seconds, "train_cpu_seconds": found.cpu_seconds,
        "compile_seconds": found.compile_seconds, "steps_per_second": len(runs) * steps / seconds,
        "steps_per_cpu_second": len(runs) * steps / found.cpu_seconds,
    }  # fmt: skip


def draw(task: Task, point: PointTask, found: dict[str, tuple[Learned, Tested]]) -> None:
    """Figures 4.29 (ours), 4.30 (all) and 4.31 (ours)."""
    from toddle.outside.navigation import toy_pictures

    for name, (done, _) in found.items():
        if name in ("document", "program", "ours"):
            steps, reward, deviation = (np.asarray(part) for part in (*done.report[:2], done.report.deviation))
            path = task.folder / f"figure-4-30-{name}.png"
            toy_pictures.curves(path, steps[0].astype(float), reward, deviation, title=f"figure 4.30: {_KINDS[name]}")
    if "ours" not in found:
        return
    done, test = found["ours"]
    noisy = {
        "epoch 1": _noisy_games(point, done.config, done.early),
        f"epoch {int(done.report.steps[0, -1]) // EPOCH}": _noisy_games(point, done.config, done.runs),
    }
    toy_pictures.games(task.folder / "figure-4-29.png", noisy, point.near, title="figure 4.29: with noise", widest=8.0)
    first = test.games[0]
    straight = [np.asarray(first.seen[: first.length[k], k]) for k in range(0, len(first.length), 3)]
    shown = {f"every third goal, seed {done.seeds[0]}": straight}
    toy_pictures.games(task.folder / "figure-4-31.png", shown, point.near, title="figure 4.31: without noise")


def _noisy_games(point: PointTask, config: PpoConfig, runs: Training, most: int = 12) -> list[np.ndarray]:
    """Games of the first run as it learns, noise and all, of 400 steps at most."""
    config = replace(config, actors=most, horizon=400, minibatch=400)
    network, moments = jax.tree.map(lambda part: part[0], (runs.network, runs.observations))
    key = jax.random.key(1)
    _, rollout = jax.jit(partial(collect, point, config))(network, moments, begin(point, config, key), key)
    seen, ended = np.asarray(rollout.rows.seen), np.asarray(rollout.rows.terminated)
    lasts = [int(over.argmax()) + 1 if over.any() else len(over) for over in ended.T]
    return [seen[:last, k] for k, last in enumerate(lasts)]


EXPERIMENT = Experiment("huber-ppo-toy", "Huber 2019, section 4.3.1 and figures 4.29-4.31", run)
