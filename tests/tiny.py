"""A small arm that learns in a moment; every test that needs a skill or a run shares these, and their compiled code."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import jax
import numpy as np

import toddle
from toddle.reach.config import ReachConfig
from toddle.reach.methods import make_learner
from toddle.reach.session import Cycle, Session, cycles, open_session, start
from toddle.reach.skill import Skill
from toddle.robots.planar import planar

SIZES: dict[str, Any] = {"samples": 400, "per_cycle": 100, "hidden": (4,), "test_points": 20}

ARM = """\
<robot name="post">
  <link name="floor"/><link name="post"/><link name="beam"/><link name="hand"/>
  <joint name="turn" type="revolute"><parent link="floor"/><child link="post"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
  <joint name="lift" type="revolute"><parent link="post"/><child link="beam"/>
    <origin xyz="0 0 1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="end" type="fixed"><parent link="beam"/><child link="hand"/><origin xyz="1 0 0"/></joint>
</robot>
"""
"""A post that turns and a beam that lifts: the hand is at (cos t cos l, sin t cos l, 1 - sin l)."""


def forward(q: np.ndarray, lengths: tuple[float, ...] = (0.5, 0.5)) -> np.ndarray:
    """Where a planar arm's tip is: each link lies at the sum of the angles so far [m]."""
    angles = np.cumsum(q)
    return np.array([np.dot(lengths, np.cos(angles)), np.dot(lengths, np.sin(angles))])


@functools.cache
def session(seed: int = 0, samples: int = 400) -> Session:
    """A run of the two-joint planar arm."""
    return open_session(planar(2), replace(ReachConfig(**SIZES), samples=samples, seed=seed))


@functools.cache
def course(seed: int = 0, samples: int = 400) -> tuple[Cycle, ...]:
    """Every cycle of that run, straight through."""
    opened = session(seed, samples)
    return tuple(cycles(opened, start(opened)))


def inverse(skill: object) -> Skill:
    """A skill that learned the inverse itself, by babbling."""
    assert isinstance(skill, Skill)
    return skill


@functools.cache
def skill(seed: int = 0) -> Skill:
    """What the two-joint planar arm has learned."""
    options: Any = {**SIZES, "seed": seed}
    return inverse(toddle.learn("planar:2", **options))


@functools.cache
def plain_skill() -> Skill:
    """The same by the thesis's own network."""
    options: Any = {**SIZES, "network": "plain"}
    return inverse(toddle.learn("planar:2", **options))


@functools.cache
def local_linear_skill() -> Skill:
    """A skill that is a local linear map, as it is before it has learned anything."""
    config = replace(skill().config, learner="local-linear", hidden=None)
    opened = session()
    learner = make_learner(config, opened.setting.box, ())
    home = opened.setting.home
    state = learner.init(jax.random.key(0), home.x, home.q)
    return replace(skill(), config=config, hidden=(), learner=learner, state=state)
