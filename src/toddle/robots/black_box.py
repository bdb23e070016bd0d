"""Anything that answers q -> x: a real arm, another simulator, a formula.

It is asked one call at a time and never looked into. What it gives back is checked, so that a fault of the
callable is told as what it is, at the call where it happened, and never reaches a learner as a NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from toddle.failures import BadInput, ToddleError


class CallablePlant:
    """A Python callable as a `toddle.robots.body.Plant`.

    Attributes:
        name: what the callable is called in messages and records.
        joints: names of the joints.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        home: where learning starts [rad or m].
        moves: calls made.
    """

    def __init__(
        self,
        function: Callable[[np.ndarray], ArrayLike],
        *,
        joints: Sequence[str],
        lower: ArrayLike,
        upper: ArrayLike,
        home: ArrayLike | None = None,
        name: str = "callable",
    ) -> None:
        """Wraps the callable; it is not called yet.

        Args:
            function: takes the joint values [rad or m], returns the tip position [m].
            joints: one name for each joint.
            lower: lower limits [rad or m].
            upper: upper limits [rad or m].
            home: joint values where learning starts; the middle of the limits when not given [rad or m].
            name: what to call it.

        Raises:
            BadInput: no joints, names that repeat, limits that are not finite or not in order, home outside them.
        """
        self.name, self.joints = name, tuple(joints)
        if not self.joints or len(set(self.joints)) < len(self.joints):
            raise BadInput(f"joints {self.joints} are none, or repeat", where=name, remedy="name every joint once")
        self.lower, self.upper = self._vector("lower", lower), self._vector("upper", upper)
        if not (self.lower < self.upper).all():
            worst = self.joints[int(np.argmin(self.upper - self.lower))]
            raise BadInput(f"the limits of {worst} are not in order", where=name, remedy="lower must be below upper")
        self.home = (self.lower + self.upper) / 2 if home is None else self._vector("home", home)
        if not ((self.home >= self.lower) & (self.home <= self.upper)).all():
            raise BadInput("home is outside the limits", where=name, remedy="choose it between lower and upper")
        self.moves = 0
        self._function = function
        self._space: int | None = None

    def move(self, q: ArrayLike) -> Float[np.ndarray, " space"]:
        """Call the callable at the joint values q, clipped to the limits.

        Args:
            q: one value for each joint [rad or m].

        Returns:
            What it answered: the tip position [m].

        Raises:
            BadInput: q has the wrong shape, or is not finite.
            ToddleError: the callable raised (its exception is the cause), or answered with something that is not a
                vector of finite numbers, or of another length than before.
        """
        command = np.clip(self._vector("q", q), self.lower, self.upper)
        self.moves += 1
        try:
            answer = self._function(command)
        except Exception as error:
            raise self._failure(f"raised {type(error).__name__}: {error}", "mend the callable") from error
        try:
            x = np.array(answer, dtype=float)
        except (TypeError, ValueError) as error:
            raise self._failure(f"answered {_short(answer)}", "return the tip position as numbers") from error
        if x.ndim != 1 or x.size == 0 or x.size != (self._space or x.size):
            wanted = f"{self._space} numbers, as before" if self._space else "a vector"
            raise self._failure(f"answered with shape {x.shape}", f"return {wanted}")
        if not np.isfinite(x).all():
            raise self._failure(f"answered {_short(x)} at q = {_short(command)}", "return finite numbers")
        self._space = x.size
        return x

    def _failure(self, what: str, remedy: str) -> ToddleError:
        return ToddleError(f"call {self.moves} {what}", where=self.name, remedy=remedy)

    def _vector(self, argument: str, values: ArrayLike) -> Float[np.ndarray, " joints"]:
        remedy = f"give {len(self.joints)} finite numbers"
        try:
            vector = np.array(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise BadInput(f"{argument} = {_short(values)} is no vector", where=self.name, remedy=remedy) from error
        if vector.shape != (len(self.joints),) or not np.isfinite(vector).all():
            raise BadInput(f"{argument} = {_short(vector)} cannot be used", where=self.name, remedy=remedy)
        return vector


def _short(value: object) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
