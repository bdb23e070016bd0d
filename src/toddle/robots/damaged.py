"""A body that breaks while it works: joints lock, weaken and slip, links bend and are replaced, at a given movement.

It is a `toddle.robots.body.Plant`: what moves it sees the tip and nothing else, and isn't told. The noise of the
seventh movement is drawn from the seed and the number seven, so that an interrupted run goes on bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from toddle.failures import BadInput, unknown_name
from toddle.robots.body import Body
from toddle.robots.chain import Chain
from toddle.robots.damage import LINK_KINDS, Damage
from toddle.robots.linkage import Linkage, linkage_of, poses

_SHORT = 0.2  # [m] a link's turn when it bends: as if it were at least so long, its body isn't known
_POINT = 1e-3  # [m] a link shorter than that has no length to change


class DamagedPlant:
    """A body that breaks while it works.

    Attributes:
        name: the body's.
        joints: the body's.
        lower: lower limits of what can be commanded [rad or m].
        upper: upper limits [rad or m].
        home: where it stands before the first movement [rad or m].
        moves: movements made.
        damages: what happens to it, in the order in which it happens; parts are joints' names.
    """

    def __init__(
        self,
        body: Body,
        damages: Sequence[Damage],
        *,
        noise: float = 0.0,
        angle_noise: float = 0.0,
        seed: int = 0,
        links: Mapping[str, str] | None = None,
    ) -> None:
        """Nothing is broken yet.

        Args:
            body: a rigid chain, or, where only joints break, any body.
            damages: what happens, in any order.
            noise: standard deviation of the seen tip on each axis [m].
            angle_noise: standard deviation of its seen orientation about each axis [rad].
            seed: of the noise, and of the direction in which links bend.
            links: the joint that carries each link, by the link's name, so that links can be named, too.

        Raises:
            BadInput: a damage names no part of this body, or one that can't break that way.
        """
        self.name, self.joints, self.moves = body.name, body.joints, 0
        self.lower, self.upper, self.home = (np.asarray(v, float) for v in (body.lower, body.upper, body.home))
        self._body, self._noise, self._angle_noise, self._seed = body, noise, angle_noise, seed
        self._linkage = linkage_of(body) if isinstance(body, Chain) else None
        settled = (damage._replace(part=_joint(damage, self.joints, links or {})) for damage in damages)
        self.damages = tuple(sorted(settled, key=lambda damage: damage.at))
        self._stood = self.home.copy()
        self._held = np.full(len(self.damages), np.nan)
        for damage in self.damages:
            self._check(damage)

    def move(self, q: np.ndarray) -> Float[np.ndarray, " space"]:
        """Go to the joint values q [rad or m], clipped to the limits; returns the tip that was seen [m]."""
        actual, linkage = self._step(q)
        if linkage is None:
            x = np.asarray(eqx.filter_jit(self._body.forward)(jnp.asarray(actual, jnp.float32)), float)
        else:
            x = poses(linkage, actual[None])[0, self._coordinates(), 3]
        return x + self._noise * self._random(0).normal(size=x.shape)

    def move_pose(self, q: np.ndarray) -> tuple[Float[np.ndarray, " space"], Float[np.ndarray, "3 3"]]:
        """Like `move`; returns the tip that was seen [m], and its orientation, a rotation from its frame to the base's.

        Raises:
            BadInput: the body knows no orientation of its tip.
        """
        pose_of = getattr(self._body, "pose", None)
        if pose_of is None:
            raise BadInput("its tip has no orientation", where=self.name, remedy="ask for positions alone")
        actual, linkage = self._step(q)
        if linkage is None:
            pose = np.asarray(eqx.filter_jit(pose_of)(jnp.asarray(actual, jnp.float32)), float)
        else:
            pose = poses(linkage, actual[None])[0]
        x = pose[self._coordinates(), 3]
        wobble = Rotation.from_rotvec(self._angle_noise * self._random(1).normal(size=3))
        return x + self._noise * self._random(0).normal(size=x.shape), wobble.as_matrix() @ pose[:3, :3]

    def actual(self, q: Float[np.ndarray, "batch joints"]) -> tuple[Float[np.ndarray, "batch joints"], Linkage | None]:
        """The truth, for a judge: the values that joints told to go to q take as the body is now, and its linkage."""
        actual = np.array(q, float)
        linkage = self._linkage
        for number, (damage, held) in enumerate(zip(self.damages, self._held, strict=True)):
            if damage.at > self.moves:
                break
            joint = self.joints.index(damage.part)
            if damage.kind in LINK_KINDS:
                linkage = self._broken(linkage, damage, number)
            else:
                actual[:, joint] = _moved(damage, actual[:, joint], held)
        return actual, linkage

    def state(self) -> dict[str, np.ndarray]:
        """Everything that the next movement depends on, as arrays by name."""
        return {"moves": np.array(self.moves), "stood": self._stood.copy(), "held": self._held.copy()}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Go back to a state that was taken down."""
        self.moves = int(state["moves"])
        self._stood, self._held = np.array(state["stood"], float), np.array(state["held"], float)

    def _step(self, q: np.ndarray) -> tuple[Float[np.ndarray, " joints"], Linkage | None]:
        """One movement: what breaks now, breaks where the joints stood."""
        self.moves += 1
        for number, damage in enumerate(self.damages):
            if damage.at <= self.moves and np.isnan(self._held[number]):
                self._held[number] = self._stood[self.joints.index(damage.part)]
        actual, linkage = self.actual(np.clip(np.asarray(q, float), self.lower, self.upper)[None])
        self._stood = actual[0]
        return actual[0], linkage

    def _random(self, what: int) -> np.random.Generator:
        return np.random.default_rng([self._seed, self.moves, what])

    def _coordinates(self) -> list[int]:
        return list(self._body.coordinates if isinstance(self._body, Chain) else range(self._body.space))

    def _check(self, damage: Damage) -> None:
        """That this body can break this way."""
        if damage.kind in LINK_KINDS:
            self._broken(self._linkage, damage, 0)
        joint = self.joints.index(damage.part)
        linkage = self._linkage
        slides = linkage is None or bool(linkage.slides[_axis_of(linkage, joint)])
        if damage.unit and damage.kind == "slip" and (damage.unit == "m") != slides:
            what, units = ("slides", "m, cm or mm") if slides else ("turns", "rad or deg")
            raise BadInput(f"{damage.part} {what}", where=str(damage), remedy=f"give its slip in {units}")

    def _broken(self, linkage: Linkage | None, damage: Damage, number: int) -> Linkage:
        """The linkage with the link after a joint bent, or of another length."""
        if linkage is None:
            remedy = "lock, weaken or slip an actuator"
            raise BadInput(f"{self.name} has no rigid links to {damage.kind}", where=str(damage), remedy=remedy)
        axis = _axis_of(linkage, self.joints.index(damage.part)) + 1
        far = linkage.before[axis] if axis < len(linkage.before) else linkage.tip
        if damage.kind == "replace":
            far = _lengthened(far, damage)
        else:
            far = _bent(far, damage.amount, np.random.default_rng([self._seed, 7919, number]), self._coordinates())
        if axis == len(linkage.before):
            return linkage._replace(tip=far)
        before = linkage.before.copy()
        before[axis] = far
        return linkage._replace(before=before)


def _moved(damage: Damage, asked: Float[np.ndarray, " batch"], held: float) -> Float[np.ndarray, " batch"]:
    """Where a broken joint goes."""
    if damage.kind == "slip":
        return asked + damage.amount
    share = 0.0 if damage.kind == "lock" else damage.amount
    return held + share * (asked - held)


def _bent(
    far: Float[np.ndarray, "4 4"], amount: float, rng: np.random.Generator, coordinates: list[int]
) -> Float[np.ndarray, "4 4"]:
    """A link's far end, shifted sideways by the amount [m] and turned as a bend at the link's foot would turn it."""
    along = far[:3, 3]
    length = float(np.linalg.norm(along))
    aside = rng.normal(size=3)
    if len(coordinates) == 2:
        aside[[k for k in range(3) if k not in coordinates]] = 0.0  # an arm in the plane stays in it
    if length > _POINT:
        aside -= along * (along @ aside) / length**2
        about = np.cross(along, aside)
    else:
        about = np.cross(rng.normal(size=3), aside)
    aside /= np.linalg.norm(aside)
    about /= np.linalg.norm(about)
    turn = Rotation.from_rotvec(about * math.atan2(amount, max(length, _SHORT))).as_matrix()
    bent = far.copy()
    bent[:3, :3] = turn @ far[:3, :3]
    bent[:3, 3] = along + amount * aside
    return bent


def _lengthened(far: Float[np.ndarray, "4 4"], damage: Damage) -> Float[np.ndarray, "4 4"]:
    length = float(np.linalg.norm(far[:3, 3]))
    if length < _POINT or length + damage.amount < _POINT:
        what = f"the link after {damage.part} is {length:.3g} m long"
        raise BadInput(what, where=str(damage), remedy="name a longer link, or a smaller amount")
    longer = far.copy()
    longer[:3, 3] *= 1 + damage.amount / length
    return longer


def _axis_of(linkage: Linkage, joint: int) -> int:
    """The axis that a joint moves most."""
    return int(np.argmax(np.abs(linkage.gain[:, joint])))


def _joint(damage: Damage, joints: tuple[str, ...], links: Mapping[str, str]) -> str:
    """The joint that a damage's part stands for: a joint, a link's name, or what only one joint's name contains."""
    if damage.part in joints:
        return damage.part
    if links.get(damage.part) in joints:
        return links[damage.part]
    holding = [name for name in joints if damage.part.lower() in name.lower()]
    if len(holding) == 1:
        return holding[0]
    raise unknown_name("joint or link", damage.part, [*joints, *links], where=str(damage))
