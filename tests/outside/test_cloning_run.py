"""A run in the world: stopped and taken up again bit for bit, divergence noticed, the best kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np
import pytest
from small_networks import LIGHT, episodes

from toddle.failures import BadInput
from toddle.navigate.cloning.episodes import Episode
from toddle.navigate.cloning.policy import Cloned
from toddle.outside.navigation.cloning_files import load_cloned
from toddle.outside.navigation.cloning_run import Cloning, Plan, Run
from toddle.outside.terminal import Stop

STAGES = (80, 120)  # looks: 10 and 15 gradient steps


def _gather(number: int, policy: Cloned | None) -> Sequence[Episode]:
    """More in the second stage, for which something must have been learned."""
    assert number == 0 or policy is not None
    return episodes(4 + 2 * number)


def _run(folder: Path, *, resume: bool = False, **more) -> Run:
    plan = Plan(folder, STAGES, {"dataset": "none"}, held=0.25, saved_every=7)
    return Cloning(LIGHT, plan, more.pop("gather", _gather), **more).run(resume=resume)


class _StopsAfter(Stop):
    """Asked for at the so manieth look at it."""

    def __init__(self, looks: int) -> None:
        self._left = looks

    @property
    def asked(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        self._left -= 1
        return self._left < 0


@pytest.mark.parametrize("after", [3, 15])
def test_a_run_goes_on_bit_for_bit(after: int, tmp_path: Path) -> None:
    """Stopped in the first stage, and in the second."""
    whole = _run(tmp_path / "whole")
    stopped = _run(tmp_path / "parts", stop=_StopsAfter(after))
    assert stopped.progress.stopped == "it was asked to stop"
    assert stopped.progress.done < whole.progress.done
    rest = _run(tmp_path / "parts", resume=True)
    assert rest.progress.done == whole.progress.done == 25
    for one, other in zip(jax.tree.leaves(whole.policy.network), jax.tree.leaves(rest.policy.network), strict=True):
        assert np.array_equal(one, other)
    again = load_cloned(tmp_path / "parts")
    assert np.array_equal(again.network.steer, whole.policy.network.steer)


def test_divergence_is_noticed_and_the_last_sound_policy_kept(tmp_path: Path) -> None:
    def gather(number: int, policy: Cloned | None) -> Sequence[Episode]:
        broken = [np.full_like(one.taught, np.nan) for one in episodes()]
        given = episodes()
        return given if number == 0 else [one._replace(taught=bad) for one, bad in zip(given, broken, strict=True)]

    found = _run(tmp_path, gather=gather)
    assert found.progress.diverged
    assert "not finite" in str(found.progress.stopped)
    assert np.isfinite(load_cloned(tmp_path).network.steer).all()


def test_the_best_that_was_judged_is_kept(tmp_path: Path) -> None:
    scores, seen = iter([0.5, 0.9, 0.2]), []

    def judge(policy: Cloned) -> float:
        seen.append(np.asarray(policy.network.steer))
        return next(scores)

    found = _run(tmp_path, judge=judge)
    assert np.array_equal(found.policy.network.steer, seen[1])
    assert found.figures["judged_success"] == 0.9
    assert np.array_equal(load_cloned(tmp_path).network.steer, seen[1])


def test_it_ends_early_where_nothing_gets_better(tmp_path: Path) -> None:
    scores = iter([0.5, 0.4, 0.4, 0.4, 0.4])
    plan = Plan(tmp_path, (400,), held=0.25, judgements=5, patience=2)
    found = Cloning(LIGHT, plan, lambda number, policy: episodes(), judge=lambda policy: next(scores)).run()
    assert found.progress.stopped == "it got no better in 2 judgements"
    assert [score for _, score in found.progress.scores] == [0.5, 0.4, 0.4]


def test_another_plan_is_refused(tmp_path: Path) -> None:
    _run(tmp_path, stop=_StopsAfter(3))
    with pytest.raises(BadInput, match="other numbers"):
        Cloning(LIGHT, Plan(tmp_path, (80,)), _gather).run(resume=True)


def test_stopped_before_it_began(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="stopped before"):
        Cloning(LIGHT, Plan(tmp_path, (80,)), lambda number, policy: None).run()
