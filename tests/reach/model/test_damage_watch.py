import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

import toddle
from toddle.reach.model.damage_watch import JUMP, Level, Watch, look, surprises
from toddle.reach.model.rigid import Rigid
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of

SENSOR = 1e-3


@pytest.fixture(scope="module")
def arm():
    body = toddle.load("nicu")
    assert isinstance(body, Chain)
    root = 3e-5 * np.random.default_rng(0).normal(size=(34, 34))
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    return Rigid(linkage_of(body), root @ root.T), lower, upper


def watched(model, q, x, wild=0.0):
    """The alarms of movements, one after another."""
    watch, alarms = Watch.start(wild), []
    for row, tip in zip(q, x, strict=True):
        watch, alarm = look(watch, row, tip, model, SENSOR)
        alarms.append(alarm)
    return alarms


def seen(model, q, rng, slip=None):
    actual = q if slip is None else q + slip
    return model.forward(actual) + SENSOR * rng.normal(size=(len(q), 3))


def test_the_surprise_of_noise_alone_is_chi_squared(arm):
    model, lower, upper = arm
    model = Rigid(model.linkage, 0 * model.covariance)
    rng = np.random.default_rng(1)
    q = rng.uniform(lower, upper, (4000, 4))
    d2 = surprises(model, q, seen(model, q, rng), SENSOR)
    for share in (0.5, 0.9, 0.99):
        assert (d2 < chi2.ppf(share, 3)).mean() == pytest.approx(share, abs=0.025)


def test_a_body_that_is_well_raises_no_alarm(arm):
    model, lower, upper = arm
    rng = np.random.default_rng(2)
    q = rng.uniform(lower, upper, (600, 4))
    assert {alarm.level for alarm in watched(model, q, seen(model, q, rng))} == {Level.CALM}


def test_a_slip_is_suspected_at_once_and_confirmed_by_the_next_movement(arm):
    model, lower, upper = arm
    rng = np.random.default_rng(3)
    q = rng.uniform(lower, upper, (12, 4))
    x = seen(model, q, rng)
    x[10:] = seen(model, q[10:], rng, slip=np.array([0, 0.2, 0, 0]))
    alarms = watched(model, q, x)
    assert [alarm.level for alarm in alarms[8:]] == [Level.CALM, Level.CALM, Level.SUSPECTED, Level.CONFIRMED]
    assert [alarm.since for alarm in alarms[8:]] == [0, 0, 1, 2]
    assert alarms[10].surprise > JUMP


def test_one_wild_look_is_suspected_and_forgotten(arm):
    model, lower, upper = arm
    rng = np.random.default_rng(4)
    q = rng.uniform(lower, upper, (12, 4))
    x = seen(model, q, rng)
    x[5] += 0.5
    levels = [alarm.level for alarm in watched(model, q, x)]
    assert levels[5] is Level.SUSPECTED
    assert levels[9:] == [Level.CALM] * 3
    assert Level.CONFIRMED not in levels


def test_one_look_in_twenty_may_be_wild_and_damage_still_shows(arm):
    model, lower, upper = arm
    rng = np.random.default_rng(5)
    q = rng.uniform(lower, upper, (400, 4))
    x = seen(model, q, rng)
    wild = rng.random(400) < 0.05
    x[wild] += rng.uniform(-1, 1, (int(wild.sum()), 3))
    x[360:] = seen(model, q[360:], rng, slip=np.array([0.2, 0, 0, 0]))
    levels = [alarm.level for alarm in watched(model, q, x, wild=0.05)]
    assert Level.CONFIRMED not in levels[:360]
    assert Level.CONFIRMED in levels[360:366]


def test_a_change_too_small_for_one_movement_is_noticed_in_time(arm):
    model, lower, upper = arm
    rng = np.random.default_rng(6)
    q = rng.uniform(lower, upper, (300, 4))
    alarms = watched(model, q, seen(model, q, rng, slip=np.array([0, 0.01, 0, 0])))
    first = [alarm.level for alarm in alarms].index(Level.CONFIRMED)
    assert first < 60
    assert alarms[first].since > first / 3


@given(st.lists(st.floats(0, 0.2), min_size=1, max_size=12), st.floats(0, 1))
def test_whatever_is_seen_the_watch_stays_within_bounds(sizes, wild):
    body = toddle.load("nicu")
    assert isinstance(body, Chain)
    model = Rigid(linkage_of(body), np.zeros((34, 34)))
    watch, q = Watch.start(wild), np.zeros(4)
    for count, size in enumerate(sizes, 1):
        watch, alarm = look(watch, q, model.forward(q[None])[0] + np.array([size, 0, 0]), model, SENSOR)
        assert watch.odds >= 0
        assert watch.drift >= 0
        assert 0 <= alarm.since <= count
        assert (alarm.level is Level.CALM) == (alarm.since == 0)
