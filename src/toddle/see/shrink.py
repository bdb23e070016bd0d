"""A depth image made small: what a policy sees (Huber 2019, figure 4.15), each pixel the mean of those it covers.

The mean is of inverse depths, which is what cameras measure, weighted by confidence: a few far pixels would drown near
ones in a mean of metres.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32

from toddle.signals import DepthImage

_LEAST = 0.05  # mean confidence below which nothing is known


def shrunk(image: DepthImage, rows: int = 60, columns: int = 80) -> Float32[np.ndarray, "{rows} {columns}"]:
    """Depth [m], 0 where it is not known.

    Args:
        image: as seen.
        rows: of the result.
        columns: of the result.
    """
    depth = image.depth.astype(np.float32)
    known = depth > 0  # not NaN either
    weight = np.where(known, image.confidence, np.float32(0)).astype(np.float32)
    near = np.divide(weight, depth, out=np.zeros_like(depth), where=known)
    mean, total = (cv2.resize(one, (columns, rows), interpolation=cv2.INTER_AREA) for one in (near, weight))
    good = (total > np.float32(_LEAST)) & (mean > 0)
    return np.divide(total, mean, out=np.zeros_like(mean), where=good)
