"""From trusted disparities here and there to a disparity everywhere: smoothing that stops at the picture's edges.

Both ways smooth disparity times confidence, and confidence, and divide (Huber 2019, equations 2.139 to 2.142): by
weighted least squares (Min et al. 2014), as the document does, or by the guided filter (He et al. 2013), a quarter of
the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import cv2
import numpy as np
from jaxtyping import Float32

from toddle.see.matchers import Found, Grey

_NOTHING = 1e-7  # smoothed confidence that tells nothing


@runtime_checkable
class Smoother(Protocol):
    """Fills in what a matcher left open."""

    def smooth(self, found: Found, guide: Grey) -> Found:
        """Disparity and confidence everywhere.

        Args:
            found: by a matcher.
            guide: the left picture, whose edges the result keeps to.
        """
        ...


@dataclass(frozen=True)
class LeastSquares:
    """Weighted least squares.

    Attributes:
        smoothness: lambda of equation 2.141.
        range_: sigma of equation 2.140 [grey values].
    """

    smoothness: float = 1e4
    range_: float = 1.0

    def smooth(self, found: Found, guide: Grey) -> Found:
        """Disparity and confidence everywhere."""
        solver = cv2.ximgproc.createFastGlobalSmootherFilter(guide, self.smoothness, self.range_)
        weighted = solver.filter(found.disparity * found.confidence)
        return _divided(weighted, solver.filter(found.confidence))


@dataclass(frozen=True)
class Guided:
    """The guided filter, first near, then wide, where nothing is near.

    Attributes:
        near: radius [pixels].
        wide: radius [pixels].
        contrast: squared steps of brightness below which it smooths over them [grey values^2].
    """

    near: int = 4
    wide: int = 12
    contrast: float = 30.0

    def smooth(self, found: Found, guide: Grey) -> Found:
        """Disparity and confidence everywhere."""
        weighted, weight = found.disparity * found.confidence, found.confidence
        for radius in (self.near, self.wide):
            both = cv2.ximgproc.guidedFilter(guide, cv2.merge([weighted, weight]), radius, self.contrast)
            more, weight_more = both[..., 0], both[..., 1]
            weighted, weight = more, weight_more
        return _divided(weighted, weight)


def _divided(weighted: Float32[np.ndarray, "rows columns"], weight: Float32[np.ndarray, "rows columns"]) -> Found:
    """Equation 2.142."""
    known = weight > np.float32(_NOTHING)
    disparity = np.where(known, weighted / np.maximum(weight, np.float32(_NOTHING)), np.float32(0))
    return Found(np.maximum(disparity, np.float32(0)), np.clip(weight, 0, 1))
