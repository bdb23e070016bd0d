"""Direction sampling against a transcription in plain Python, and whether it learns to reach."""

from __future__ import annotations

from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.reach import loop, unit_box
from toddle.reach.explore.direction import WalkNoise, direction_sampling
from toddle.reach.explore.explorer import Home
from toddle.reach.learn.local_linear import local_linear_map
from toddle.reach.unit_box import UnitBox
from toddle.robots.planar import planar

HOME = Home(jnp.array([0.5, 0.4, 0.6]), jnp.array([0.3, 0.7]))
SPAN_Q, SPAN_X, LOW_X = np.array([2.0, 3.0, 1.5]), np.array([1.6, 1.6]), np.array([-0.7, -0.9])
BOX = UnitBox(jnp.zeros(3), jnp.array(SPAN_Q, jnp.float32), jnp.array(LOW_X, jnp.float32), jnp.full(2, 1.6))
SLOPES = np.array([[1.3, -0.4], [0.3, 1.2], [-0.9, 0.8]])
SIGMA, STEP, HOME_STEP, STALL, P_HOME = 0.2, 0.05, 0.15, 0.1, 0.4


def answer(x: jax.Array) -> jax.Array:
    """Some inverse estimate, rough enough to saturate now and then."""
    return HOME.q + jnp.asarray(SLOPES, jnp.float32) @ (x - HOME.x)


def body(q: jax.Array) -> jax.Array:
    """Some forward kinematics in the unit box."""
    return 0.5 + 0.5 * jnp.stack([jnp.cos(2 * q[0] + q[2]), jnp.sin(3 * q[1] - q[2])])


def test_it_is_the_algorithm() -> None:
    """Every proposal and weight, by the words of Rolf 2013 and Mahboob 2015, equations 4.1, 4.2 and 4.5."""
    explorer = direction_sampling(BOX, step=STEP, sigma=SIGMA, p_home=P_HOME, home_step=HOME_STEP, stall=STALL)
    count = 300
    drawn = explorer.draw(jax.random.key(0), count, HOME)

    def step(state, noise):
        state, proposal = explorer.propose(state, noise, answer, HOME)
        x = body(proposal.q)
        state, weight = explorer.observe(state, proposal, x, HOME)
        return state, (proposal.q, proposal.goal, x, weight)

    q_all, goals, x_all, weights = (np.array(v, float) for v in jax.lax.scan(step, explorer.init(HOME), drawn)[1])
    noise = WalkNoise(*(np.array(leaf, float) for leaf in drawn))  # pyright: ignore[reportArgumentType]

    home_q, home_x = np.array(HOME.q, float), np.array(HOME.x, float)
    q, x, goal = home_q, home_x, home_x
    doing, happened = "new line", Counter()
    linear, constant, direction = np.zeros((3, 2)), np.zeros(3), np.zeros(2)
    for t in range(count):
        if t == 0:
            linear, constant = SIGMA * noise.linear[0], SIGMA * noise.constant[0]
        else:
            keep = np.sqrt(SIGMA**2 / (SIGMA**2 + (0.1 * SIGMA) ** 2))
            linear = keep * (linear + 0.1 * SIGMA * noise.linear[t])
            constant = keep * (constant + 0.1 * SIGMA * noise.constant[t])
        happened[doing] += 1
        if doing == "home":
            wanted = q + np.clip((home_q - q) * SPAN_Q, -HOME_STEP, HOME_STEP) / SPAN_Q
            np.testing.assert_allclose(goals[t], home_x, atol=1e-5)
        else:
            if doing == "new line":
                goal, direction = x, noise.direction[t]
            goal = goal + STEP * direction / SPAN_X
            perturbed = linear @ (LOW_X + goal * SPAN_X) + constant
            wanted = np.clip(home_q + SLOPES @ (goal - home_x) + perturbed / SPAN_Q, 0, 1)
            np.testing.assert_allclose(goals[t], goal, atol=1e-4)
        np.testing.assert_allclose(q_all[t], wanted, atol=1e-4)

        dx, dq = (x_all[t] - x) * SPAN_X, (q_all[t] - q) * SPAN_Q
        efficiency = min(1.0, np.linalg.norm(dx) / max(np.linalg.norm(dq), 1e-12))
        cosine = dx @ direction / max(np.linalg.norm(dx), 1e-12)
        expected = efficiency if doing == "home" else efficiency * (1 + cosine) / 2
        np.testing.assert_allclose(weights[t], expected, atol=1e-3)
        q, x = q_all[t], x_all[t]
        if doing == "home":
            doing = "new line" if np.allclose(q, home_q, atol=1e-6) else "home"
        elif dx @ direction < STALL * STEP:
            doing = "home" if noise.chance[t] < P_HOME else "new line"
        else:
            doing = "line"
    assert min(happened[what] for what in ("home", "new line", "line")) > 20, happened


def test_the_perturbation_keeps_its_size() -> None:
    """The random walk of A and b has the standard deviation sigma at all times."""
    explorer = direction_sampling(BOX, sigma=SIGMA)

    def end(key: jax.Array) -> jax.Array:
        noise = explorer.draw(key, 60, HOME)
        step = lambda state, drawn: (explorer.propose(state, drawn, answer, HOME)[0], None)  # noqa: E731
        state = jax.lax.scan(step, explorer.init(HOME), noise)[0]
        return jnp.append(state.linear.ravel(), state.constant)

    entries = np.array(jax.jit(jax.vmap(end))(jax.random.split(jax.random.key(3), 400)))
    np.testing.assert_allclose(np.std(entries), SIGMA, rtol=0.05)
    np.testing.assert_allclose(np.mean(entries), 0.0, atol=0.02)


def test_it_learns_to_reach_from_home() -> None:
    """Four joints, 20,000 movements: targets on an arc in front of the arm, away from all that home can answer."""
    arm = planar(4)
    _, positions = unit_box.sample_reachable(arm, jax.random.key(0), 2000)
    box = unit_box.around(np.array(arm.lower), np.array(arm.upper), np.array(positions), isotropic=True)
    home = Home(box.q_to_unit(arm.home), box.x_to_unit(arm.forward(arm.home)))
    learner = local_linear_map(2)
    setting = loop.Setting(box, home, direction_sampling(box, sigma=0.1, p_home=0.5), learner)
    angle = jnp.linspace(0.0, 1.2, 20)
    targets = 0.8 * jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=-1)
    start = loop.begin(setting, jax.random.key(1))
    before = float(jnp.mean(loop.open_loop_errors(setting, arm, start, targets)))
    end, movements = loop.advance_jit(setting, arm, start, 20_000)
    after = float(jnp.mean(loop.open_loop_errors(setting, arm, end, targets)))
    assert before > 0.3
    assert after < 0.04
    assert np.all((np.array(movements.q) >= 0) & (np.array(movements.q) <= 1))
    assert np.all((np.array(movements.weight) >= 0) & (np.array(movements.weight) <= 1 + 1e-6))


@pytest.mark.parametrize("wrong", [{"step": 0.0}, {"sigma": -1.0}, {"home_step": float("nan")}, {"p_home": 1.5}])
def test_parameters_that_cannot_be_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="give a"):
        direction_sampling(BOX, **wrong)
