"""PPO on any Gymnasium environment: it acts on the host, one call of the networks a step; it learns as everywhere.

The environments' own state can't be saved. So that a run that is taken up again goes on bit for bit, all copies begin
anew after every so many updates, and wherever a run is taken up: save it just then. What comes after such a cut counts
by its value, like at the end of any rollout; the cut episodes are in no figure of the report.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, Shaped

from toddle.navigate.ppo.collect import Actors, Row, normalised, valued
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import bounded
from toddle.navigate.ppo.learn import fresh_optimiser
from toddle.navigate.ppo.moments import Moments, unseen
from toddle.navigate.ppo.network import ActorCritic, actor_critic, forgotten
from toddle.navigate.ppo.training import Report, Training, update
from toddle.navigate.task import Outcome
from toddle.outside.navigation.gym_copies import Copies


class GymTraining:
    """Learning on copies of an environment.

    Attributes:
        copies: of the environment.
        config: how.
        anew_every: updates after which all copies begin anew; 0: never.
    """

    def __init__(self, name: str, config: PpoConfig, anew_every: int = 0) -> None:
        """Makes the copies.

        Raises:
            BadInput: the environment is of no use, see `toddle.outside.navigation.gym_task.opened`.
        """
        self.copies = Copies(name, config.actors)
        self.config, self.anew_every = config, anew_every
        self._next: bytes | None = None

    def init(self, key: PRNGKeyArray) -> Training:
        """A run before its first update."""
        spaces, (making, key) = self.copies.spaces, jax.random.split(key)
        network = actor_critic(self.config, spaces.observations, spaces.actions, making)
        seen = jnp.zeros((self.config.actors, spaces.observations), jnp.float32)
        return Training(
            network, fresh_optimiser(network), unseen(spaces.observations), unseen(1), _began(self.config, seen),
            key, jnp.zeros((), jnp.int32),
        )  # fmt: skip

    def advance(self, training: Training) -> tuple[Training, Report]:
        """Collect, then learn: one update."""
        actors, rows = self.collect(training)
        training, report = _learned(self.config, training._replace(actors=actors), rows)
        self._next = _bytes(training.key)
        return training, report

    def collect(self, training: Training) -> tuple[Actors, HostRows]:
        """T steps of each copy, in as many calls as the slowest needs: one that begins anew in a call of its own is
        late. What others do beyond T is lost: their next rows start from there.
        """
        drawing, beginning = jax.random.split(jax.random.split(training.key)[0])
        actors = self._anew(training.actors, beginning) if self._begins_anew(training) else training.actors
        seen, started, memory = np.asarray(actors.observation), np.asarray(actors.started), actors.memory
        total, length, discounted = (np.asarray(part) for part in (actors.total, actors.length, actors.discounted))
        gamma, table, call = np.float32(self.config.gamma), _Table(self.config), 0
        while not table.full:
            taken, drawn, log_prob, before, memory = _act(
                self.config, training.network, training.observations, seen, started, memory, drawing, np.int32(call)
            )
            found = self.copies.step(np.asarray(taken))
            total, length = total + found.reward, length + found.real.astype(np.int32)
            discounted = gamma * discounted + found.reward
            row = HostRows(
                seen, found.after, np.asarray(drawn), np.asarray(log_prob), found.reward, found.terminated,
                found.truncated, started, np.asarray(before), np.asarray(memory), total, length, discounted,
            )  # fmt: skip
            table.add(row, found.real)
            ended = found.terminated | found.truncated
            seen, started, call = found.following, np.where(found.real, ended, started), call + 1
            total, length, discounted = (np.where(ended, np.zeros_like(x), x) for x in (total, length, discounted))
        going = (jnp.asarray(part) for part in (total, length, discounted))
        return Actors((), jnp.asarray(seen), jnp.asarray(started), memory, *going), table.rows

    def close(self) -> None:
        """Gives back what the copies hold."""
        self.copies.close()

    def _begins_anew(self, training: Training) -> bool:
        """Where it was asked for, and where the copies are not where this run left them."""
        due = self.anew_every > 0 and int(training.updates) % self.anew_every == 0
        return due or self._next != _bytes(training.key)

    def _anew(self, actors: Actors, key: PRNGKeyArray) -> Actors:
        """All copies in new episodes; the sum that rewards are normalised by goes on."""
        seed = int(jax.random.randint(key, (), 0, 2**31 - 1 - self.config.actors))
        fresh = _began(self.config, jnp.asarray(self.copies.begin(seed)))
        return fresh._replace(discounted=actors.discounted)


class HostRows(NamedTuple):
    """What the copies saw and did, see `toddle.navigate.ppo.collect.Row`; with a leading axis, in many steps."""

    seen: Shaped[np.ndarray, "..."]
    after: Shaped[np.ndarray, "..."]
    action: Shaped[np.ndarray, "..."]
    log_prob: Shaped[np.ndarray, "..."]
    reward: Shaped[np.ndarray, "..."]
    terminated: Shaped[np.ndarray, "..."]
    truncated: Shaped[np.ndarray, "..."]
    started: Shaped[np.ndarray, "..."]
    memory: Shaped[np.ndarray, "..."]
    remembered: Shaped[np.ndarray, "..."]
    total: Shaped[np.ndarray, "..."]
    length: Shaped[np.ndarray, "..."]
    discounted: Shaped[np.ndarray, "..."]


class _Table:
    """Rows by step and copy; each copy fills its column at its own pace."""

    def __init__(self, config: PpoConfig) -> None:
        self._horizon, self._filled = config.horizon, np.zeros(config.actors, int)
        self._copies = np.arange(config.actors)
        self._rows: HostRows | None = None

    @property
    def full(self) -> bool:
        return bool((self._filled == self._horizon).all())

    @property
    def rows(self) -> HostRows:
        assert self._rows is not None
        return self._rows

    def add(self, row: HostRows, real: Bool[np.ndarray, " actors"]) -> None:
        """What each copy did in a call, where it made a step and its column has room."""
        if self._rows is None:
            self._rows = HostRows(*(np.zeros((self._horizon, *part.shape), part.dtype) for part in row))
        who = self._copies[real & (self._filled < self._horizon)]
        at = self._filled[who]
        for column, part in zip(self._rows, row, strict=True):
            column[at, who] = part[who]
        self._filled[who] += 1


def _began(config: PpoConfig, seen: Float[Array, "actors numbers"]) -> Actors:
    """All copies at the start of an episode."""
    none, count = jnp.zeros(config.actors, jnp.float32), jnp.zeros(config.actors, jnp.int32)
    memory = jnp.broadcast_to(forgotten(config), (config.actors, 2, 2, config.memory))
    return Actors((), seen, jnp.ones(config.actors, bool), memory, none, count, none)


def _bytes(key: PRNGKeyArray) -> bytes:
    return np.asarray(jax.random.key_data(key)).tobytes()


@partial(jax.jit, static_argnums=0)
def _act(
    config: PpoConfig,
    network: ActorCritic,
    moments: Moments,
    seen: Float[Array | np.ndarray, "actors numbers"],
    started: Bool[Array | np.ndarray, " actors"],
    memory: Float[Array, "actors 2 2 units"],
    key: PRNGKeyArray,
    call: Int[Array, ""] | np.int32,
) -> tuple[Shaped[Array, "..."], ...]:
    """Actions within their range, and as they were drawn; how likely they were; memories before and after."""
    memory = jnp.where(started[:, None, None, None], 0.0, memory)
    given, _, remembered = jax.vmap(network)(normalised(config, moments, jnp.asarray(seen)), memory)
    action = given.sample(jax.random.fold_in(key, call))
    return bounded(action, config.bound), action, given.log_prob(action), memory, remembered


@partial(jax.jit, static_argnums=0)
def _learned(config: PpoConfig, training: Training, rows: HostRows) -> tuple[Training, Report]:
    """The update, by what was collected on the host."""
    late = rows.truncated & ~rows.terminated
    known = rows._asdict()
    row = Row(
        **known,
        observation=normalised(config, training.observations, known["seen"]),
        outcome=jnp.where(late, int(Outcome.LATE), int(Outcome.GOES_ON)).astype(jnp.int32),
    )
    after = normalised(config, training.observations, row.after)
    return update(config, training, valued(training.network, row._replace(after=after)))
