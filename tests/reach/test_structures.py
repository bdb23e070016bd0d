"""Every structure that a body may be taken to have, alike: what it is fitted to it must know, say and keep."""

from __future__ import annotations

import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.outside.files import read_record, write_record
from toddle.outside.skills import load_skill
from toddle.reach.body_config import BodyConfig
from toddle.reach.body_run import plan, skill_from
from toddle.reach.body_skill import BodySkill
from toddle.reach.gather import Sight, gather, postures, truth
from toddle.reach.structures import STRUCTURES, structure_named, suited
from toddle.robots.black_box import CallablePlant
from toddle.robots.body import Body
from toddle.robots.catalogue import Choice

MADE = {
    "screws": ("nicu", 80),
    "curvature": ("bha", 300),
    "multilinear": ("planar:2", 150),
    "network": ("planar:2", 150),
}


def learned(name):
    """A skill of a structure, not tested: its body, and what it saw."""
    spec, count = MADE[name]
    body = toddle.load(spec)
    assert isinstance(body, Body)
    to_do = plan(body, BodyConfig(method=name, movements=count, noise=1e-3))
    experience = gather(body, to_do.q, Sight(1e-3), seed=0)
    return body, skill_from(experience, to_do, Choice(spec))


@pytest.fixture(scope="module", params=sorted(STRUCTURES))
def made(request):
    return learned(request.param)


def unseen(body, count=50):
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    return postures(lower, upper, count, seed=99)


def test_it_puts_the_tip_where_the_body_does(made):
    body, skill = made
    q = unseen(body)
    miss = np.linalg.norm(skill.fit.model.forward(q) - truth(body, q)[0], axis=1)
    assert np.median(miss) < 3e-3
    assert skill.fit.sensor == pytest.approx(1e-3, rel=0.5)


def test_its_slope_is_that_of_its_answers(made):
    body, skill = made
    model, q = skill.fit.model, unseen(body, 5)
    x, slope = model.slope(q)
    np.testing.assert_allclose(x, model.forward(q), atol=1e-6)
    for joint in range(q.shape[1]):
        step = 1e-3 * np.eye(q.shape[1])[joint]
        expected = (model.forward(q + step) - model.forward(q - step)) / 2e-3
        np.testing.assert_allclose(slope[:, :, joint], expected, atol=1e-3)


def test_its_spread_is_a_covariance(made):
    body, skill = made
    spread = skill.fit.model.spread(unseen(body))
    np.testing.assert_allclose(spread, spread.transpose(0, 2, 1), atol=1e-12)
    assert np.linalg.eigvalsh(spread).min() >= -1e-12


def test_it_is_solved_for_targets_and_says_how_sure_it_is(made):
    body, skill = made
    targets = truth(body, unseen(body))[0]
    answers = skill.solver.solve(targets)
    assert np.all((answers.q >= skill.lower) & (answers.q <= skill.upper))
    errors = np.linalg.norm(truth(body, answers.q)[0] - targets, axis=1)
    mean, most = skill.expectation.at(answers.q)
    assert np.median(errors) < 4e-3
    assert np.all(mean <= most)
    assert (errors <= most).mean() > 0.5
    q, distance, _ = skill.solver.nearest(targets[0] + 100.0)
    assert distance > 50
    assert np.all((q >= skill.lower) & (q <= skill.upper))


def test_it_is_saved_and_answers_as_before(made, tmp_path):
    body, skill = made
    toddle.save(skill, tmp_path)
    again, targets = load_skill(tmp_path), truth(body, unseen(body, 5))[0]
    assert isinstance(again, BodySkill)
    np.testing.assert_array_equal(again.predict(targets), skill.predict(targets))
    # arrays come back in C's order, and sums in another order round otherwise
    np.testing.assert_allclose(again.expectation.at(unseen(body, 5)), skill.expectation.at(unseen(body, 5)), rtol=1e-5)


def test_an_altered_skill_is_refused(made, tmp_path):
    _, skill = made
    toddle.save(skill, tmp_path)
    facts, tensors = read_record(tmp_path, "skill", "skill")
    tensors["skill.lower"] = tensors["skill.lower"][:-1]
    write_record(tmp_path, "skill", "skill", facts, tensors)
    with pytest.raises(BadInput, match="not a skill of this version"):
        load_skill(tmp_path)


def test_what_suits_a_body_is_told():
    bodies = {spec: toddle.load(spec) for spec in ("nicu", "bha")}
    assert suited(bodies["nicu"]) == (("screws",), "a rigid arm (4 joints), so its axes are looked for")
    assert suited(bodies["bha"])[0] == ("curvature",)
    black_box = CallablePlant(lambda q: q, joints=["a", "b"], lower=[0, 0], upper=[1, 1])
    assert suited(black_box)[0] == ("screws", "curvature", "multilinear", "network")
    with pytest.raises(BadInput, match="did you mean screws"):
        structure_named("screw")
