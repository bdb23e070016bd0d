"""A run is a value: it goes on bit for bit, many run side by side, and where it goes wrong is said."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import Report, Training, init, learning_rate, train, train_seeds
from toddle.navigate.ppo.trouble import trouble
from toddle.navigate.task import Continuous, Discrete
from toddle.navigate.tasks.probes import Answered

TASK = Answered(Continuous(1))
CONFIG = PpoConfig(steps=640, actors=4, horizon=16, minibatch=32, epochs=2, hidden=(8,), learning_rate=1e-2)
BEGUN = jax.jit(jax.vmap(lambda key: init(TASK, CONFIG, key)))


def plain(part: Any) -> np.ndarray:
    """An array as NumPy's; of a random key, its words."""
    return np.array(jax.random.key_data(part) if jnp.issubdtype(part.dtype, jax.dtypes.prng_key) else part)


def leaves(tree: Any) -> list[np.ndarray]:
    return [plain(part) for part in jax.tree.leaves(tree)]


def through_numpy(training: Training) -> Training:
    """As from a file."""

    def back(part: jax.Array) -> jax.Array:
        kept = jnp.asarray(plain(part))
        return jax.random.wrap_key_data(kept) if jnp.issubdtype(part.dtype, jax.dtypes.prng_key) else kept

    return jax.tree.map(back, training)


@pytest.fixture(scope="module")
def runs() -> Training:
    """Three runs at their start."""
    return BEGUN(jax.random.split(jax.random.key(3), 3))


@pytest.fixture(scope="module")
def first(runs: Training) -> Training:
    return jax.tree.map(lambda part: part[0], runs)


@pytest.fixture(scope="module")
def four(first: Training) -> tuple[Training, Report]:
    return train(TASK, CONFIG, first, 4)


def test_going_on_is_as_never_having_stopped(first: Training, four: tuple[Training, Report]):
    half, early = train(TASK, CONFIG, first, 2)
    whole, late = train(TASK, CONFIG, through_numpy(half), 2)
    for one, other in zip(leaves(whole), leaves(four[0]), strict=True):
        np.testing.assert_array_equal(one, other)
    both = jax.tree.map(lambda a, b: np.concatenate([a, b]), early, late)
    for one, other in zip(leaves(both), leaves(four[1]), strict=True):
        np.testing.assert_array_equal(one, other)
    assert int(whole.updates) == 4
    assert late.steps.tolist() == [192, 256]


def test_each_of_many_runs_is_as_alone(runs: Training, four: tuple[Training, Report]):
    together, reports = train_seeds(TASK, CONFIG, runs, 4)
    for one, other in zip(leaves(together), leaves(four[0]), strict=True):
        np.testing.assert_allclose(one[0], other, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(reports.value_loss[0], four[1].value_loss, rtol=1e-3)
    assert len({float(loss) for loss in reports.value_loss[:, 0]}) == 3


def test_a_healthy_run_is_in_no_trouble(four: tuple[Training, Report]):
    assert trouble(four[1], TASK.actions) is None


def test_a_diverging_run_is_named(first: Training):
    wild = dataclasses.replace(CONFIG, learning_rate=1e3, gradient_norm=1e9)
    _, report = train(TASK, wild, first, 4)
    why = trouble(report, TASK.actions)
    assert why is not None
    assert "--learning-rate" in why


@pytest.mark.parametrize(
    ("part", "value", "actions", "said"),
    [
        ("policy_loss", np.nan, Continuous(1), "policy loss is no longer finite"),
        ("value_loss", np.inf, Continuous(1), "value loss is no longer finite"),
        ("gradient", np.nan, Discrete(2), "gradient is no longer finite"),
        ("kl", 50.0, Discrete(2), "leapt by 50 nats"),
        ("entropy", 1e-6, Discrete(2), "entropy has collapsed"),
        ("deviation", 1e-5, Continuous(1), "deviation has collapsed"),
    ],
)
def test_trouble_in_any_update_is_named(
    four: tuple[Training, Report], part: str, value: float, actions: Continuous | Discrete, said: str
):
    report = four[1]._replace(entropy=jnp.full(4, 0.5))
    worse = getattr(report, part).at[2].set(value)
    why = trouble(report._replace(**{part: worse}), actions)
    assert why is not None
    assert said in why


@pytest.mark.parametrize(("schedule", "rates"), [("constant", [0.01, 0.01, 0.01]), ("linear", [0.01, 0.005, 0])])
def test_learning_rate(schedule: Any, rates: list[float]):
    config = dataclasses.replace(CONFIG, schedule=schedule)
    assert config.updates == 10
    found = [float(learning_rate(config, jnp.int32(done))) for done in (0, 5, 12)]
    assert found == pytest.approx(rates)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"actors": 0}, "actors"),
        ({"gamma": 1.5}, "gamma"),
        ({"lambda_": float("nan")}, "lambda"),
        ({"learning_rate": -1.0}, "learning_rate"),
        ({"c2": float("inf")}, "c2"),
        ({"kl_limit": -0.1}, "kl_limit"),
        ({"minibatch": 30}, "minibatch"),
        ({"minibatch": 1}, "minibatch"),
        ({"hidden": ()}, "hidden"),
        ({"memory": 4, "sequence": 5}, "sequence"),
        ({"bound": "tahn"}, "tanh"),
        ({"activation": "gelu"}, "activation"),
        ({"schedule": "linaer"}, "linear"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(wrong: dict[str, Any], said: str, unchecked: None):
    with pytest.raises(BadInput, match=said):
        dataclasses.replace(CONFIG, **wrong)
