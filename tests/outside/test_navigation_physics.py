"""Drivers are interchangeable; a policy meets on the robot what it met in training; physics is judged by its truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.driver import Baseline, Driver, Learned, Situation, Steering, Timed
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments, unseen
from toddle.navigate.ppo.network import actor_critic
from toddle.navigate.scenarios.layouts import Layout, layouts
from toddle.navigate.task import Outcome
from toddle.navigate.tasks.unicycle import unicycle
from toddle.navigate.tasks.walker import WalkerTask
from toddle.outside.navigation.course import (
    PACE,
    Course,
    Finish,
    Rules,
    courses_of,
    path_length,
    rules_of,
    strolls,
    summary,
)
from toddle.outside.navigation.course_pictures import all_paths, cases
from toddle.outside.navigation.guided import Guided
from toddle.outside.navigation.physics import Ready, ready, run_course
from toddle.outside.navigation.physics_batch import Recipe, baseline, run_courses, same
from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.outside.teleoperation.commands import follow
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Circle, Velocity
from toddle.walk.scenarios import Leg

TASK = WalkerTask(unicycle(seconds=0.1), hold=4, circles=3, people=2, observe="full", rays=6)
SIMPLE = WalkerTask(unicycle(seconds=0.1), hold=4)
AHEAD = Velocity(0.25, 0.0, 0.0)
SITUATION = Situation(0.0, np.array([0.1, -0.2, 0.4]), (1.5, 0.5), Velocity(0.1, 0.0, 0.05), (Circle(0.9, 0.1, 0.2),))


def policy(task: WalkerTask, memory: int = 0) -> Policy:
    """A real network that nobody trained; its normaliser has seen something."""
    config = PpoConfig(hidden=(8,), memory=memory, bound="tanh")
    network = actor_critic(config, task.observations, task.actions, jax.random.key(3))
    moments: Moments = unseen(task.observations)
    moments = moments._replace(mean=moments.mean + 0.3)
    return Policy(network, moments, config, task.observations, task.actions)


def always(velocity: Velocity | None) -> Timed:
    return Timed(lambda t: velocity)


DRIVERS: dict[str, Callable[[], Driver]] = {
    "script": lambda: Timed(follow((Leg(0.0, AHEAD),), 5.0)),
    "guide": lambda: Guided(),
    "baseline": lambda: Learned(Baseline(), SIMPLE),
    "policy": lambda: Learned(policy(TASK), TASK),
    "policy with a memory": lambda: Learned(policy(TASK, memory=4), TASK),
    "policy of the document": lambda: Learned(policy(SIMPLE), SIMPLE),
}


@pytest.mark.parametrize("make", DRIVERS.values(), ids=DRIVERS.keys())
def test_a_driver_keeps_nothing_and_answers_with_a_velocity(make: Callable[[], Driver]) -> None:
    driver = make()
    assert isinstance(driver, Driver)
    begin = driver.start()
    velocity, memory = driver.decide(begin, SITUATION)
    assert velocity is not None
    assert all(map(math.isfinite, velocity))
    then = SITUATION._replace(t=0.5, place=np.array([0.3, 0.0, 0.2]))
    second, _ = driver.decide(memory, then)
    assert driver.decide(begin, SITUATION)[0] == velocity
    assert driver.decide(memory, then)[0] == second


@given(st.integers(1, 60), st.integers(1, 200))
def test_a_driver_is_asked_once_a_period_and_its_word_holds(each: int, ticks: int) -> None:
    asked: list[float] = []

    def source(t: float) -> Velocity:
        asked.append(t)
        return Velocity(t, 0.0, 0.0)

    t, steering = 0.0, Steering(Timed(source, each * 0.01), lambda t: SITUATION._replace(t=t))
    for number in range(ticks):
        said = steering(t)
        assert said is not None
        assert said.vx == pytest.approx(0.01 * each * (number // each), abs=1e-6)
        t += 0.01
    assert len(asked) == math.ceil(ticks / each)


def test_steering_ends_with_the_driver_or_at_the_goal_and_stays_so() -> None:
    script = Steering(Timed(follow((Leg(0.0, AHEAD),), 0.5)), lambda t: SITUATION._replace(t=t))
    assert [script(0.01 * tick) for tick in (0, 49, 50, 10)] == [AHEAD, AHEAD, None, None]
    places = iter([1.0, 0.5, 0.15, 2.0])
    near = Steering(always(AHEAD), lambda t: SITUATION._replace(place=np.array([1.5 - next(places), 0.5, 0.0])), 0.2)
    assert [near(0.01 * tick) for tick in range(4)] == [AHEAD, AHEAD, None, None]


@pytest.mark.parametrize("memory", [0, 4])
def test_a_policy_decides_on_a_robot_as_in_training(memory: int) -> None:
    learned = Learned(policy(TASK, memory), TASK)
    where = layouts(5, 1, circles=3)
    state, observation = TASK.begin(Layout(where.goal[0], where.circles[0]), jax.random.key(1))
    inside, outside = learned.policy.start(), learned.start()
    step, choose = jax.jit(TASK.step), jax.jit(learned.policy)
    for number in range(12):
        rows = jnp.concatenate([state.circles, state.people.circles]).astype(float).tolist()
        seen = tuple(Circle(*row) for row in rows if row[2] >= 0)
        place, velocity = np.asarray(state.place, float), Velocity(*TASK.walks.velocity(state.walker).tolist())
        goal = (float(state.goal[0]), float(state.goal[1]))
        said, outside = learned.decide(outside, Situation(number * TASK.dt, place, goal, velocity, seen))
        action, inside = choose(observation, inside)
        assert said is not None
        np.testing.assert_allclose(said, TASK.velocity(action), atol=2e-6)
        state, after = step(state, action, jax.random.key(number))
        observation = after.observation


def test_where_a_robot_does_not_know_its_place_nothing_steers_it() -> None:
    lost = SITUATION._replace(place=np.full(3, np.nan))
    said, _ = Learned(Baseline(), SIMPLE).decide(Learned(Baseline(), SIMPLE).start(), lost)
    assert not all(map(math.isfinite, said))  # the gate makes it stand
    steering = Steering(always(AHEAD), lambda t: lost, near=0.2)
    assert steering(0.0) == AHEAD


def test_the_guide_waits_while_somebody_stands_on_the_goal() -> None:
    guided = Guided()
    taken = SITUATION._replace(circles=(Circle(1.5, 0.4, 0.25),))
    assert guided.decide(guided.start(), taken)[0] == STILL
    assert guided.decide(None, SITUATION)[0] != STILL


@lru_cache(maxsize=1)
def heicub() -> Humanoid:
    return load_humanoid("heicub")


@lru_cache(maxsize=1)
def prepared() -> Ready:
    return ready(heicub(), Course((1.0, 0.0)))


def walked(driver: Driver, course: Course, rules: Rules | None = None, **more: Any) -> Finish:
    return run_course(heicub(), driver, course, rules, before=prepared(), **more)[0]


def test_a_goal_is_reached_and_the_path_tells_so() -> None:
    finish = walked(Learned(Baseline(), SIMPLE), Course((0.9, 0.4)))
    assert finish.outcome == Outcome.WON
    left = np.hypot(*(finish.path[:, 1:3] - [0.9, 0.4]).T)
    first = int(np.argmax(left <= 0.2))
    assert finish.path[first, 0] == finish.seconds
    assert left[-1] < 0.25  # it came to stand there
    assert finish.path[-1, 0] > finish.seconds + 0.5
    assert finish.shortest == pytest.approx(math.hypot(0.9, 0.4) - 0.2)
    assert 0.7 < finish.spl <= 1
    assert 0.001 < finish.zmp_error < 0.05
    assert {foot.side for foot in finish.feet} == {0, 1}


def test_a_course_runs_again_bit_for_bit() -> None:
    course, world, rules = Course((0.4, 0.5)), WorldOptions(noise=Noise()), Rules(seconds=2.5)
    fresh, there = run_course(heicub(), Guided(), course, rules, world=world, seed=4)
    again, same_there = run_course(heicub(), Guided(), course, rules, world=world, seed=4, before=there)
    assert same_there is there
    assert len(fresh.path) == 50
    np.testing.assert_array_equal(fresh.path, again.path)
    other, _ = run_course(heicub(), Guided(), course, rules, world=world, seed=5, before=there)
    assert not np.array_equal(fresh.path[:50], other.path[:50])


def test_a_cylinder_in_the_way_is_run_into_by_the_stubborn_unless_the_walker_is_told() -> None:
    course, rules = Course((1.5, 0.0), (Circle(0.5, 0.0, 0.1),)), Rules(seconds=4.0, told=False)
    blind = walked(always(AHEAD), course, rules)
    assert blind.outcome == Outcome.COLLIDED
    assert blind.clearance < 0.005
    told = walked(always(AHEAD), course, replace(rules, told=True))
    assert told.outcome == Outcome.LATE
    assert 0.02 < told.clearance < 0.6


def test_somebody_who_stands_is_a_circle_and_one_who_walks_up_is_felt() -> None:
    stands = np.tile([[[0.9, 0.05]]], (2, 1, 1))
    rules = Rules(seconds=1.5)
    one = walked(always(AHEAD), Course((2.0, 0.0), (Circle(0.9, 0.05, 0.25),)), rules)
    other = walked(always(AHEAD), Course((2.0, 0.0), people=stands), rules)
    np.testing.assert_array_equal(one.path, other.path)
    comes = np.linspace([[1.0, 0.0]], [[0.0, 0.0]], 26)
    hit = walked(always(STILL), Course((2.0, 0.0), people=comes), Rules(seconds=3.0))
    assert hit.outcome == Outcome.COLLIDED
    assert 1.2 < hit.seconds < 2.0  # at 0.4 m/s from 1 m to its own radius and the robot's 0.1 to 0.25 m


def test_the_other_ends() -> None:
    assert walked(always(STILL), Course((1.0, 0.0)), Rules(seconds=0.5)).outcome == Outcome.LATE
    assert walked(always(AHEAD), Course((-0.5, 0.0)), Rules(far=0.7)).outcome == Outcome.LOST
    gave_up = walked(always(None), Course((1.0, 0.0)))
    assert (gave_up.outcome, gave_up.seconds < 1.0) == (Outcome.LATE, True)
    slippery = WorldOptions(friction=0.02)
    fell = walked(always(AHEAD), Course((2.0, 0.0)), Rules(seconds=15.0), world=slippery)
    assert fell.outcome == Outcome.FELL
    with pytest.raises(BadInput, match="raise far"):
        walked(always(STILL), Course((5.0, 0.0)))
    with pytest.raises(BadInput, match="near"):
        _ = Rules(near=0.0)


def test_processes_find_what_one_finds() -> None:
    courses = [Course((0.9, 0.0)), Course((0.0, 0.5), (Circle(-0.6, 0.0, 0.1),)), Course((0.3, -0.3))]
    recipe, rules = Recipe(same, (Guided(),)), Rules(seconds=1.2)
    told: list[int] = []
    alone = run_courses(recipe, courses, rules, processes=1, progress=lambda number, _: told.append(number))
    assert told == [0, 1, 2]
    shared = run_courses(recipe, courses, rules, processes=2, progress=lambda number, _: told.append(number))
    assert sorted(told[3:]) == [0, 1, 2]
    for one, other in zip(alone, shared, strict=True):
        assert one is not None
        assert other is not None
        assert one.outcome == other.outcome
        np.testing.assert_array_equal(one.path, other.path)


def test_a_batch_stops_with_what_it_has() -> None:
    done: list[int] = []
    found = run_courses(
        Recipe(baseline), [Course((0.4, 0.0))] * 3, processes=1,
        progress=lambda number, _: done.append(number), stopped=lambda: len(done) > 0,
    )  # fmt: skip
    assert [finish is None for finish in found] == [False, True, True]
    with pytest.raises(BadInput, match="nobody"):
        run_courses(Recipe(baseline, robot="nobody"), [Course((1.0, 0.0))], processes=1)


@given(st.floats(-3.0, 3.0), st.floats(0.1, 0.4), st.floats(0.0, 0.05))
def test_the_sway_of_the_steps_is_no_way_gone(angle: float, speed: float, sway: float) -> None:
    t = np.arange(0.0, 12.01, 0.05)
    aside = sway * np.sin(2 * np.pi * t / 1.2)
    along = np.array([math.cos(angle), math.sin(angle)])
    places = speed * t[:, None] * along + aside[:, None] * np.array([-along[1], along[0]])
    path = np.column_stack([t, places, np.zeros(len(t))])
    assert path_length(path, 1.2) == pytest.approx(12.0 * speed, rel=1e-6)
    assert path_length(path[:1], 1.2) == 0.0


def test_people_are_where_they_were_drawn_and_go_straight_in_between() -> None:
    course = Course((2.0, 0.0), people=strolls(1, (2.0, 0.0), 3, 5.0, clear=0.7))
    assert course.people is not None
    assert course.people.shape == (51, 3, 2)
    assert np.hypot(*np.diff(course.people, axis=0).T).max() <= 0.4 * PACE + 1e-6
    assert np.hypot(*np.diff(course.people, axis=0).T).max() > 0
    middle = np.array([circle[:2] for circle in course.walking(0.25)])
    np.testing.assert_allclose(middle, (course.people[2] + course.people[3]) / 2)
    np.testing.assert_allclose([circle[:2] for circle in course.walking(99.0)], course.people[-1])


def test_a_summary_counts_each_end_once() -> None:
    def finish(outcome: Outcome, length: float) -> Finish:
        return Finish(outcome, 2.0, np.zeros((2, 4)), (), length, 1.0, 0.5, 0.01)

    found = summary([finish(Outcome.WON, 1.25), finish(Outcome.FELL, 0.1), finish(Outcome.COLLIDED, 0.1)])
    assert (found["courses"], found["won"], found["falls"], found["collisions"], found["late"]) == (3, 1, 1, 1, 0)
    assert found["spl_mean"] == pytest.approx(0.8 / 3)
    assert found["success_rate"] == pytest.approx(1 / 3)


def test_drawn_layouts_become_courses_by_the_rules_of_their_task() -> None:
    drawn = layouts(2, 20, circles=3)
    courses = courses_of(drawn)
    assert [len(course.circles) for course in courses] == (drawn.circles[:, :, 2] >= 0).sum(axis=1).tolist()
    assert rules_of(TASK) == Rules(TASK.seconds, TASK.near, TASK.far, TASK.told, body=TASK.body)


def test_pictures_show_the_paths(tmp_path: Path) -> None:
    ways = [np.column_stack([np.linspace(0, 5, 60), np.linspace(0, end, 60), np.zeros((60, 2))]) for end in (1.0, -1.0)]
    finishes = [
        Finish(outcome, 5.0, way, (), 1.0, 1.0, 0.5, 0.01)
        for outcome, way in zip((Outcome.WON, Outcome.FELL), ways, strict=True)
    ]
    courses = [Course((1.0, 0.0), (Circle(0.5, 0.5, 0.2),)), Course((-1.0, 0.0), people=np.zeros((60, 1, 2)))]
    cases(tmp_path / "cases.png", courses, finishes, title="two", gait=heicub().gait)
    all_paths(tmp_path / "all.png", courses, finishes, title="all")
    assert all((tmp_path / name).read_bytes()[:4] == b"\x89PNG" for name in ("cases.png", "all.png"))
