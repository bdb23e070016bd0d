"""Kernels of the ray-caster. Along a ray the parameter is the depth: directions have length 1 along the optical axis.

A box is met by slabs (Kay, Kajiya 1986), a cylinder by its quadratic equation and two caps; both are upright, so that
only the yaw turns them. A solid is only looked for in the rectangle of pixels that its corners span.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

FAR = 1e6
NEAR = 0.02
_TINY = 1e-12


@njit(cache=True, fastmath=True)
def _span(middle, half, cos, sin, position, axes, fx, fy, cx, cy, rows, columns):
    """First and last row and column that a solid can be seen in; last < first: none."""
    umin, umax, vmin, vmax = 1e9, -1e9, 1e9, -1e9
    behind = 0
    for corner in range(8):
        a = half[0] if corner & 1 else -half[0]
        b = half[1] if corner & 2 else -half[1]
        c = half[2] if corner & 4 else -half[2]
        dx = middle[0] + cos * a - sin * b - position[0]
        dy = middle[1] + sin * a + cos * b - position[1]
        dz = middle[2] + c - position[2]
        z = axes[0, 2] * dx + axes[1, 2] * dy + axes[2, 2] * dz
        if z <= NEAR:
            behind += 1
            continue
        u = cx + fx * (axes[0, 0] * dx + axes[1, 0] * dy + axes[2, 0] * dz) / z
        v = cy + fy * (axes[0, 1] * dx + axes[1, 1] * dy + axes[2, 1] * dz) / z
        umin, umax, vmin, vmax = min(umin, u), max(umax, u), min(vmin, v), max(vmax, v)
    if behind == 8:
        return 0, -1, 0, -1
    if behind:
        return 0, rows - 1, 0, columns - 1
    top, bottom = max(0, math.ceil(max(vmin, -1.0))), min(rows - 1, math.floor(min(vmax, rows + 1.0)))
    left, right = max(0, math.ceil(max(umin, -1.0))), min(columns - 1, math.floor(min(umax, columns + 1.0)))
    return int(top), int(bottom), int(left), int(right)


@njit(cache=True, fastmath=True)
def _box_row(a0, a1, b0, b1, c0, c1, oa, ob, oc, ha, hb, hc, xs, left, right, number, depth, solid):
    """One row of a box: along each of its axes a ray is ``0 + x 1``, from the origin o."""
    for column in range(left, right + 1):
        x = xs[column]
        ia, ib, ic = 1.0 / (a0 + x * a1 + _TINY), 1.0 / (b0 + x * b1 + _TINY), 1.0 / (c0 + x * c1 + _TINY)
        ra, rb, rc = ha * abs(ia), hb * abs(ib), hc * abs(ic)
        ma, mb, mc = -oa * ia, -ob * ib, -oc * ic
        enter, leave = max(ma - ra, mb - rb, mc - rc), min(ma + ra, mb + rb, mc + rc)
        nearest = (enter <= leave) & (enter > NEAR) & (enter < depth[column])
        depth[column] = enter if nearest else depth[column]
        solid[column] = number if nearest else solid[column]


@njit(cache=True, fastmath=True)
def _cylinder_row(a0, a1, b0, b1, c0, c1, oa, ob, oc, ha, hc, xs, left, right, number, depth, solid):
    """One row of an upright cylinder, in the same way."""
    c = oa * oa + ob * ob - ha * ha
    for column in range(left, right + 1):
        x = xs[column]
        ra, rb = a0 + x * a1, b0 + x * b1
        a, b = ra * ra + rb * rb + _TINY, oa * ra + ob * rb
        square = b * b - a * c
        root, ic = math.sqrt(max(square, 0.0)), 1.0 / (c0 + x * c1 + _TINY)
        mc, rc = -oc * ic, hc * abs(ic)
        enter, leave = max((-b - root) / a, mc - rc), min((root - b) / a, mc + rc)
        nearest = (square > 0.0) & (enter <= leave) & (enter > NEAR) & (enter < depth[column])
        depth[column] = enter if nearest else depth[column]
        solid[column] = number if nearest else solid[column]


@njit(cache=True, fastmath=True)
def _hall_row(a0, a1, b0, b1, c0, c1, oa, ob, oc, ha, hb, hc, xs, first, depth, solid):
    """One row of the hall, seen from inside; its slabs are solids: floor, ceiling, +x, -x, +y, -y."""
    for column in range(len(xs)):
        x = xs[column]
        ra, rb, rc = a0 + x * a1 + _TINY, b0 + x * b1 + _TINY, c0 + x * c1 + _TINY
        ta = ((ha if ra > 0 else -ha) - oa) / ra
        tb = ((hb if rb > 0 else -hb) - ob) / rb
        tc = ((hc if rc > 0 else -hc) - oc) / rc
        far = min(ta, tb, tc)
        depth[column] = far
        upright = (2 if ra > 0 else 3) if ta <= tb else (4 if rb > 0 else 5)
        solid[column] = first + ((1 if rc > 0 else 0) if tc <= far else upright)


@njit(cache=True, fastmath=True)
def cast(middle, half, yaw, rounds, hall, position, axes, fx, fy, cx, cy, depth, solid):
    """The nearest solid at each pixel.

    Args:
        middle, half, yaw, rounds: of each solid; the last six are the hall's slabs.
        hall: x, y, yaw, half length, half width, height of the room within them.
        position, axes: of the camera; columns of the axes: its x, y, z.
        fx, fy, cx, cy: of the camera [pixels].
        depth: written [m]; FAR where there is nothing.
        solid: written; -1 where there is nothing.
    """
    rows, columns = depth.shape
    xs = (np.arange(columns) - cx) / fx
    cos, sin = math.cos(hall[2]), math.sin(hall[2])
    oa, ob, oc, t = _into(cos, sin, position[0] - hall[0], position[1] - hall[1], position[2] - hall[5] / 2, axes)
    count = len(yaw)
    if abs(oa) < hall[3] and abs(ob) < hall[4] and abs(oc) < hall[5] / 2:
        count -= 6
        for row in range(rows):
            y = (row - cy) / fy
            _hall_row(
                t[0, 2] + y * t[0, 1], t[0, 0], t[1, 2] + y * t[1, 1], t[1, 0], t[2, 2] + y * t[2, 1], t[2, 0],
                oa, ob, oc, hall[3], hall[4], hall[5] / 2, xs, count, depth[row], solid[row],
            )  # fmt: skip
    else:
        depth[:] = FAR
        solid[:] = -1
    for number in range(count):
        m, h = middle[number], half[number]
        cos, sin = math.cos(yaw[number]), math.sin(yaw[number])
        top, bottom, left, right = _span(m, h, cos, sin, position, axes, fx, fy, cx, cy, rows, columns)
        if bottom < top or right < left:
            continue
        oa, ob, oc, t = _into(cos, sin, position[0] - m[0], position[1] - m[1], position[2] - m[2], axes)
        for row in range(top, bottom + 1):
            y = (row - cy) / fy
            a0, b0, c0 = t[0, 2] + y * t[0, 1], t[1, 2] + y * t[1, 1], t[2, 2] + y * t[2, 1]
            if rounds[number]:
                _cylinder_row(
                    a0, t[0, 0], b0, t[1, 0], c0, t[2, 0], oa, ob, oc, h[0], h[2],
                    xs, left, right, number, depth[row], solid[row],
                )  # fmt: skip
            else:
                _box_row(
                    a0, t[0, 0], b0, t[1, 0], c0, t[2, 0], oa, ob, oc, h[0], h[1], h[2],
                    xs, left, right, number, depth[row], solid[row],
                )  # fmt: skip


@njit(cache=True, fastmath=True)
def _into(cos, sin, x, y, z, axes):
    """A camera in the frame of something turned by a yaw: its place there, and its axes."""
    turned = np.empty((3, 3))
    for axis in range(3):
        turned[0, axis] = cos * axes[0, axis] + sin * axes[1, axis]
        turned[1, axis] = cos * axes[1, axis] - sin * axes[0, axis]
        turned[2, axis] = axes[2, axis]
    return cos * x + sin * y, cos * y - sin * x, z, turned


@njit(cache=True, fastmath=True)
def _lit(nx, ny, nz, ambient, directions, colours, light):
    """The light on a surface, by its normal; at most 1, as OpenGL has it."""
    for channel in range(3):
        light[channel] = ambient[channel]
    for lamp in range(len(directions)):
        facing = -(nx * directions[lamp, 0] + ny * directions[lamp, 1] + nz * directions[lamp, 2])
        if facing > 0:
            for channel in range(3):
                light[channel] = min(light[channel] + facing * colours[lamp, channel], 1.0)


@njit(cache=True, fastmath=True)
def lights(yaw, ambient, directions, colours):
    """The light on the faces of boxes: +x, -x, +y, -y of their own frame, above, below."""
    found = np.empty((len(yaw), 6, 3))
    for number in range(len(yaw)):
        cos, sin = math.cos(yaw[number]), math.sin(yaw[number])
        _lit(cos, sin, 0.0, ambient, directions, colours, found[number, 0])
        _lit(-cos, -sin, 0.0, ambient, directions, colours, found[number, 1])
        _lit(-sin, cos, 0.0, ambient, directions, colours, found[number, 2])
        _lit(sin, -cos, 0.0, ambient, directions, colours, found[number, 3])
        _lit(0.0, 0.0, 1.0, ambient, directions, colours, found[number, 4])
        _lit(0.0, 0.0, -1.0, ambient, directions, colours, found[number, 5])
    return found


@njit(cache=True, fastmath=True)
def shade(
    middle, half, yaw, rounds, surface, position, axes, fx, fy, cx, cy, depth, solid,
    texels, starts, sizes, tiles, ambient, directions, colours, picture,
):  # fmt: skip
    """The colour of each pixel: its texel, from the level as fine as the pixel, times the light on it.

    Args:
        middle, half, yaw, rounds, surface: of each solid.
        position, axes, fx, fy, cx, cy: of the camera.
        depth, solid: as `cast` wrote them.
        texels: of all levels of all textures, from 0 to 255.
        starts: the first texel of each level of each texture.
        sizes: side of each level [texels], the finest first.
        tiles: side of each texture [m].
        ambient, directions, colours: of the light.
        picture: written.
    """
    rows, columns = depth.shape
    faces, side_light = lights(yaw, ambient, directions, colours), np.empty(3)
    turns = np.empty((len(yaw), 2))
    for number in range(len(yaw)):
        turns[number, 0], turns[number, 1] = math.cos(yaw[number]), math.sin(yaw[number])
    for row in range(rows):
        y = (row - cy) / fy
        for column in range(columns):
            number = solid[row, column]
            if number < 0:
                picture[row, column] = 0
                continue
            x, far = (column - cx) / fx, depth[row, column]
            rx = axes[0, 2] + x * axes[0, 0] + y * axes[0, 1]
            ry = axes[1, 2] + x * axes[1, 0] + y * axes[1, 1]
            rz = axes[2, 2] + x * axes[2, 0] + y * axes[2, 1]
            dx = position[0] + far * rx - middle[number, 0]
            dy = position[1] + far * ry - middle[number, 1]
            cos, sin = turns[number, 0], turns[number, 1]
            a, b, c = cos * dx + sin * dy, cos * dy - sin * dx, position[2] + far * rz - middle[number, 2]
            over_a, over_b = abs(a) - half[number, 0], abs(b) - half[number, 1]
            over_c = abs(c) - half[number, 2]
            if rounds[number]:
                over_a, over_b = math.sqrt(a * a + b * b) - half[number, 0], -1.0
            if over_c >= max(over_a, over_b):
                light, facing, s, t = faces[number, 4 if c > 0 else 5], abs(rz), a, b
            elif rounds[number]:
                nx, ny = (cos * a - sin * b) / half[number, 0], (sin * a + cos * b) / half[number, 0]
                _lit(nx, ny, 0.0, ambient, directions, colours, side_light)
                light, facing, s, t = side_light, abs(nx * rx + ny * ry), math.atan2(b, a) * half[number, 0], c
            elif over_a >= over_b:
                light, facing, s, t = faces[number, 0 if a > 0 else 1], abs(cos * rx + sin * ry), b, c
            else:
                light, facing, s, t = faces[number, 2 if b > 0 else 3], abs(cos * ry - sin * rx), a, c
            kind = surface[number]
            width = 0.75 * far / fx / max(facing, 0.15)  # of the pixel, on the surface
            level, fine = 0, tiles[kind] / sizes[0]
            while fine < width and level < len(sizes) - 1:
                level, fine = level + 1, 2 * fine
            size, scale = sizes[level], 1.0 / fine
            i, j = math.floor(t * scale) & (size - 1), math.floor(s * scale) & (size - 1)
            texel = starts[kind, level] + i * size + j
            for channel in range(3):
                picture[row, column, channel] = texels[texel, channel] * light[channel] + 0.5
