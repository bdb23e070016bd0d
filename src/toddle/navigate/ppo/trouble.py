"""Noticing that a run goes wrong: numbers that aren't finite, a policy that has stopped to explore, one that leaps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toddle.navigate.ppo.training import Report
from toddle.navigate.task import Actions, Discrete

_NARROWEST = 1e-3  # standard deviation of an action whose range is 2
_SUREST = 1e-4  # entropy of a choice, as a share of the greatest
_LEAP = 10.0  # between two policies [nats]; a sound update stays under 0.1


def trouble(report: Report, actions: Actions) -> str | None:
    """Why to stop after an update, in words; None: there is no reason.

    Args:
        report: of one update, or of several with a leading axis.
        actions: of the task.
    """
    for name in ("policy_loss", "value_loss", "entropy", "kl", "gradient", "reward"):
        if not np.isfinite(np.asarray(getattr(report, name))).all():
            return f"the {name.replace('_', ' ')} is no longer finite; learn more slowly (--learning-rate)"
    kl, entropy = _worst(report.kl, max), _worst(report.entropy, min)
    if kl > _LEAP:
        return f"the policy leapt by {kl:.3g} nats in one update; learn more slowly (--learning-rate)"
    remedy = "reward exploring more (--c2), or learn more slowly (--learning-rate)"
    if isinstance(actions, Discrete):
        if entropy < _SUREST * math.log(actions.count):
            return f"the policy's entropy has collapsed to {entropy:.2g} nats; {remedy}"
    elif _worst(report.deviation, min) < _NARROWEST:
        return f"the actions' deviation has collapsed to {_worst(report.deviation, min):.2g}; {remedy}"
    return None


def _worst(part: Any, of: Any) -> float:
    return float(of(np.ravel(np.asarray(part))))
