"""What may be said of a humanoid in a configuration file; whatever is left out is inferred from the model."""

from __future__ import annotations

from dataclasses import dataclass

from toddle.robots.gait import Gait

GAIT_KEYS = (
    "com_height",
    "foot_distance",
    "step_time",
    "double_support",
    "step_height",
    "margin",
    "hull",
    "longest_turn",
    "fastest_turn",
    "sample",
    "preview",
    "steps",
)
"""Settings that are the gait's, by the same name."""


@dataclass(frozen=True)
class Settings:
    """A humanoid's particulars; None (or empty): inferred from the model.

    Attributes:
        name: how it is called.
        base: link that floats.
        left_foot: frame on the left foot: a link, fixed or not, or a site.
        right_foot: the same on the right.
        waist: frame on the pelvis.
        chest: frame on the upper torso.
        imu: frame of the inertial unit.
        forward: the base's axis that points ahead: x, -x, y or -y.
        without: links that are left out, with all that hangs on them.
        moves: joints besides the legs that walking moves.
        held: joints besides the legs that have a servo in any case, as do those that carry over 1 % of the mass.
        welded: joints that are rigid, at zero.
        sole_length: of the box under a foot [m].
        sole_width: of the same [m].
        sole_ahead: of its middle before the ankle [m].
        sole_depth: of the floor under the ankle [m].
        foot_distance: between the soles' origins, standing [m].
        com_height: of the centre of mass over the floor, walking [m].
        step_time: of one step [s].
        double_support: part of it [s].
        step_height: of the swing foot [m].
        margin: kept from the sole's edges, ahead and aside [m].
        hull: where the left sole may land, seen from the right one: corners x, y [m], clockwise from the rear
            inner one.
        longest_turn: between the yaws of two feet [rad].
        fastest_turn: between the yaw rates of two feet [rad/s].
        sample: of the preview [s].
        preview: samples looked ahead.
        steps: footsteps looked ahead.
        fastest: greatest command [m/s, m/s, rad/s].
        stiffness: of the servos [N m/rad].
        damping: of the servos [N m s/rad].
        reflected: inertia of the motors at the joints [kg m^2].
        effort: torque where the description gives none that is plausible [N m].
        gait: all of it, for a robot of the catalogue; what is said above goes before it.
    """

    name: str | None = None
    base: str | None = None
    left_foot: str | None = None
    right_foot: str | None = None
    waist: str | None = None
    chest: str | None = None
    imu: str | None = None
    forward: str | None = None
    without: tuple[str, ...] = ()
    moves: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    welded: tuple[str, ...] = ()
    sole_length: float | None = None
    sole_width: float | None = None
    sole_ahead: float | None = None
    sole_depth: float | None = None
    foot_distance: float | None = None
    com_height: float | None = None
    step_time: float | None = None
    double_support: float | None = None
    step_height: float | None = None
    margin: tuple[float, float] | None = None
    hull: tuple[tuple[float, float], ...] | None = None
    longest_turn: float | None = None
    fastest_turn: float | None = None
    sample: float | None = None
    preview: int | None = None
    steps: int | None = None
    fastest: tuple[float, float, float] | None = None
    stiffness: float | None = None
    damping: float | None = None
    reflected: float | None = None
    effort: float | None = None
    gait: Gait | None = None
