"""What can be chosen about the walker: each term of the balance station can be switched off by itself."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from toddle.failures import BadInput
from toddle.walk.balance.step_adjustment import StepWeights

TICK = 0.01
"""Period of the control loop [s]."""


@dataclass(frozen=True)
class WalkConfig:
    """How the walker balances.

    Attributes:
        adapt_steps: the swing foot lands where the DCM needs it.
        adapt_time: the step ends when the DCM needs it.
        feed_forward: servos are commanded ahead by the torque they have to hold.
        correct_velocity: an integral on the achieved velocity.
        release_pitch: the swing foot's pitch is free until it comes down.
        follow_measured: the reference of the centre of mass is drawn to the measured one.
        plan_steps: the predictive controller plans the steps; else they follow from the command alone.
        step: weights of the step adjustment.
        zmp_gain: K of p = p_ref + K (xi - xi_ref).
        pressed: share of the soles, about their middles, that the zero moment point is kept in.
        follow: share of the measured state in the reference, each tick.
        offset_time: of the integral that takes away what the servos sag [s].
        offset_most: its limit [m].
        velocity_gain: of the velocity's integral, each step.
        velocity_most: its limit on vx and vy [m/s], and on omega [rad/s].
        earliest: a step lasts at least so long [s] at 0.6 s a step; it scales with the step's time.
        latest: and at most so many nominal times.
        freeze: the landing is no longer moved so shortly before it [s].
        touchdown: share of the swing after which contact ends the step.
        swing_speed: the landing is not moved farther than this takes the swing foot [m/s].
        fall_speed: how fast a swing foot that is to land at once comes down [m/s].
        lowering: the swing foot is just over the floor so long before it is to land, at first [s].
        punctual: share of a landing's lateness by which the next ones are brought forward.
        late: a step waits so long for its touchdown [s].
        shift_time: of the weight shift before the first step [s].
        lead: the next plan is made so long after the last [s].
        deadline_ms: a plan that took longer is dropped; None: no deadline.
    """

    adapt_steps: bool = True
    adapt_time: bool = True
    feed_forward: bool = True
    correct_velocity: bool = True
    release_pitch: bool = True
    follow_measured: bool = True
    plan_steps: bool = True
    step: StepWeights = field(default_factory=StepWeights)
    zmp_gain: float = 1.7
    pressed: float = 1.0
    follow: float = 0.1
    offset_time: float = 1.0
    offset_most: float = 0.03
    velocity_gain: float = 0.15
    velocity_most: tuple[float, float] = (0.08, 0.2)
    earliest: float = 0.33
    latest: float = 1.15
    freeze: float = 0.06
    touchdown: float = 0.6
    swing_speed: float = 1.0
    fall_speed: float = 0.3
    lowering: float = 0.03
    punctual: float = 0.05
    late: float = 0.15
    shift_time: float = 0.3
    lead: float = 0.1
    deadline_ms: float | None = None

    def __post_init__(self) -> None:
        """Refuses negative times and gains.

        Raises:
            BadInput: a number below zero.
        """
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, float) and not value >= 0:
                raise BadInput(f"{value} is no use", where=f"walk option {item.name}", remedy="give 0 or more")
