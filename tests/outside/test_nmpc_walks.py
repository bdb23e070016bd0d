"""The walker that tasks steer: one callback for all, the same by both solvers, behind the safety gate."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB

from toddle.failures import BadInput
from toddle.navigate.walks import Walks
from toddle.outside.navigation import nmpc_walks as module
from toddle.outside.navigation.nmpc_walks import nmpc_walks
from toddle.robots.gait import Gait
from toddle.signals import STILL, Circle, Velocity
from toddle.walk.gate import gate
from toddle.walk.pattern.reduced import Reduced

NONE = jnp.zeros((0, 3))
CIRCLES = jnp.array([[0.8, 0.1, 0.15], [0.0, 0.0, -1.0]])


@lru_cache
def walks(solver: str = "native", hold: int = 4) -> Walks:
    return nmpc_walks(ICUB, solver=solver, hold=hold, threads=2)  # type: ignore[arg-type]


def walked(walker: Walks, commands: jax.Array, circles: jax.Array) -> tuple:
    """Places, velocities and falls of one walker under a row of commands."""

    def step(state, command):
        state = walker.advance(state, command, circles)
        return state, (walker.place(state), walker.velocity(state), walker.fallen(state))

    return jax.lax.scan(step, walker.start(), commands)[1]


def asked(seed: int, *shape: int) -> jax.Array:
    return jax.random.uniform(jax.random.key(seed), (*shape, 3), minval=-0.4, maxval=0.4)


def test_a_walker_goes_where_the_pattern_alone_goes_behind_the_gate():
    commands = asked(1, 8)
    places, velocities, fallen = jax.jit(lambda rows: walked(walks(), rows, CIRCLES))(commands)
    pattern, allowed = Reduced(ICUB), STILL
    state = pattern.start()
    for k, command in enumerate(np.asarray(commands, float).tolist()):
        for _ in range(4):
            allowed = gate(allowed, Velocity(*command), ICUB.fastest, ICUB.sample)
            state, _ = pattern.step(state, allowed, [Circle(*np.asarray(CIRCLES[0], float).tolist())])
        at = state.at
        wanted = [*at.com[:, 0], (at.support.yaw + at.lifted.yaw) / 2]
        np.testing.assert_allclose(places[k], wanted, atol=2e-5)
        np.testing.assert_allclose(velocities[k], allowed, atol=1e-6)
    assert not fallen.any()


def test_walkers_mapped_twice_walk_as_each_does():
    commands = asked(2, 2, 10, 3)
    many = jax.jit(jax.vmap(jax.vmap(lambda rows: walked(walks(), rows, CIRCLES))))(commands)
    for i, j in ((0, 0), (1, 9)):
        alone = walked(walks(), commands[i, j], CIRCLES)
        jax.tree.map(lambda part, one, i=i, j=j: np.testing.assert_array_equal(part[i, j], one), many, alone)


def test_all_walkers_of_a_map_go_in_one_call(monkeypatch):
    sizes: list[int] = []
    step = module.step_gated

    def counted(problem, gated, wanted, circles, **rest):
        sizes.append(len(wanted))
        return step(problem, gated, wanted, circles, **rest)

    monkeypatch.setattr(module, "step_gated", counted)
    jax.block_until_ready(jax.jit(jax.vmap(jax.vmap(lambda rows: walked(walks(), rows, NONE))))(asked(3, 3, 50, 2)))
    assert sizes == [150, 150]


def test_a_long_scan_of_many_walkers_ends():
    walker = walks(hold=1)

    @jax.jit
    def run(key):
        def step(state, key):
            mixed = jax.random.normal(key, (200, 200))  # work for the threads that the callback might wait for
            command = asked_by(key) + 1e-6 * (mixed @ mixed).mean()
            return jax.vmap(lambda s, v: walker.advance(s, v, NONE))(state, command), None

        def asked_by(key):
            return jax.random.uniform(key, (256, 3), minval=-0.3, maxval=0.3)

        start = jax.vmap(lambda _: walker.start())(jnp.arange(256))
        end, _ = jax.lax.scan(step, start, jax.random.split(key, 500))
        return jax.vmap(walker.place)(end), jax.vmap(walker.fallen)(end)

    places, fallen = run(jax.random.key(0))
    assert jnp.isfinite(places).all()
    assert not fallen.any()


def test_both_solvers_walk_alike_and_share_their_states():
    commands = asked(5, 4, 5)
    native, batch = (
        jax.jit(jax.vmap(partial(walked, walks(solver), circles=CIRCLES)))(commands) for solver in ("native", "batch")
    )
    np.testing.assert_allclose(native[0], batch[0], atol=1e-3)
    np.testing.assert_allclose(native[1], batch[1], atol=1e-6)
    assert jax.tree.structure(walks("native").start()) == jax.tree.structure(walks("batch").start())


@pytest.mark.parametrize("gait", [ICUB, HRP2, HEICUB])
def test_it_stands_starts_slowly_and_says_what_it_can_do(gait):
    walker = nmpc_walks(gait, hold=2, threads=1)
    assert walker.seconds == 2 * gait.sample
    assert walker.fastest == tuple(gait.fastest)
    start = walker.start()
    state = walker.advance(start, jnp.zeros(3), NONE)
    stays = 1e-4 if gait.start is None else 0.06  # else the weight comes to the middle
    np.testing.assert_allclose(walker.place(state), walker.place(start), atol=stays)
    state = walker.advance(state, jnp.full(3, 9.0), NONE)
    assert (np.asarray(walker.velocity(state)) <= 2 * gait.sample * np.array([0.3, 0.3, 0.6]) + 1e-6).all()
    assert not walker.fallen(state)


def test_a_walker_that_is_lost_has_fallen():
    walker, at = walks(), walks().start().walk.at
    for com in (jnp.nan, 1.0):
        state = walker.start()
        walk = state.walk._replace(at=at._replace(com=at.com.at[0, 0].set(com)))
        assert walker.fallen(state._replace(walk=walk))
    state = walker.start()
    plan = state.walk.plan._replace(violation=jnp.float32(0.2))
    assert walker.fallen(state._replace(walk=state.walk._replace(plan=plan)))


def test_what_cannot_be_is_refused(unchecked):
    refused: tuple[dict[str, Any], ...] = ({"solver": "nativ"}, {"hold": 0}, {"threads": 0})
    for given in refused:
        with pytest.raises(BadInput, match=next(iter(given))):
            nmpc_walks(ICUB, **given)
    with pytest.raises(BadInput, match=r"6\.5 samples"):
        nmpc_walks(Gait(0.465, 0.14, 0.18, 0.10, step_time=0.65))
