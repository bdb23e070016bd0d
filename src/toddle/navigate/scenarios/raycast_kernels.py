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
_EPS = 1e-9


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
def _inverse(value):
    return 1.0 / value if abs(value) > _EPS else (1.0 / _EPS if value >= 0 else -1.0 / _EPS)


@njit(cache=True, fastmath=True)
def _box(origin, ray, half):
    """Depth at which a ray enters a box; FAR: it doesn't, or starts in it."""
    enter, leave = NEAR, FAR
    for axis in range(3):
        inverse = _inverse(ray[axis])
        middle, reach = -origin[axis] * inverse, half[axis] * abs(inverse)
        enter, leave = max(enter, middle - reach), min(leave, middle + reach)
    return enter if NEAR < enter <= leave else FAR


@njit(cache=True, fastmath=True)
def _cylinder(origin, ray, half):
    """Depth at which a ray enters an upright cylinder; FAR: it doesn't, or starts in it."""
    a = ray[0] * ray[0] + ray[1] * ray[1]
    b = origin[0] * ray[0] + origin[1] * ray[1]
    c = origin[0] * origin[0] + origin[1] * origin[1] - half[0] * half[0]
    enter, leave = NEAR, FAR
    if a > _EPS:
        root = b * b - a * c
        if root < 0:
            return FAR
        root = math.sqrt(root)
        enter, leave = max(enter, (-b - root) / a), (root - b) / a
    elif c > 0:
        return FAR
    inverse = _inverse(ray[2])
    middle, reach = -origin[2] * inverse, half[2] * abs(inverse)
    enter, leave = max(enter, middle - reach), min(leave, middle + reach)
    return enter if NEAR < enter <= leave else FAR


@njit(cache=True, fastmath=True)
def cast(middle, half, yaw, rounds, position, axes, fx, fy, cx, cy, depth, solid):
    """The nearest solid at each pixel.

    Args:
        middle, half, yaw, rounds: of each solid.
        position, axes: of the camera; columns of the axes: its x, y, z.
        fx, fy, cx, cy: of the camera [pixels].
        depth: written [m]; FAR where there is nothing.
        solid: written; -1 where there is nothing.
    """
    rows, columns = depth.shape
    depth[:] = FAR
    solid[:] = -1
    origin, first, across, down, ray = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for number in range(len(yaw)):
        cos, sin = math.cos(yaw[number]), math.sin(yaw[number])
        top, bottom, left, right = _span(
            middle[number], half[number], cos, sin, position, axes, fx, fy, cx, cy, rows, columns
        )
        if bottom < top or right < left:
            continue
        dx, dy = position[0] - middle[number, 0], position[1] - middle[number, 1]
        origin[0], origin[1] = cos * dx + sin * dy, cos * dy - sin * dx
        origin[2] = position[2] - middle[number, 2]
        for axis, into in ((0, across), (1, down), (2, first)):
            into[0] = cos * axes[0, axis] + sin * axes[1, axis]
            into[1] = cos * axes[1, axis] - sin * axes[0, axis]
            into[2] = axes[2, axis]
        for row in range(top, bottom + 1):
            y = (row - cy) / fy
            for column in range(left, right + 1):
                x = (column - cx) / fx
                for axis in range(3):
                    ray[axis] = first[axis] + x * across[axis] + y * down[axis]
                far = _cylinder(origin, ray, half[number]) if rounds[number] else _box(origin, ray, half[number])
                if far < depth[row, column]:
                    depth[row, column] = far
                    solid[row, column] = number


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
    for row in range(rows):
        y = (row - cy) / fy
        for column in range(columns):
            number = solid[row, column]
            if number < 0:
                for channel in range(3):
                    picture[row, column, channel] = 0
                continue
            x, far = (column - cx) / fx, depth[row, column]
            rx = axes[0, 2] + x * axes[0, 0] + y * axes[0, 1]
            ry = axes[1, 2] + x * axes[1, 0] + y * axes[1, 1]
            rz = axes[2, 2] + x * axes[2, 0] + y * axes[2, 1]
            dx = position[0] + far * rx - middle[number, 0]
            dy = position[1] + far * ry - middle[number, 1]
            cos, sin = math.cos(yaw[number]), math.sin(yaw[number])
            a, b, c = cos * dx + sin * dy, cos * dy - sin * dx, position[2] + far * rz - middle[number, 2]
            ha, hb, hc = half[number, 0], half[number, 1], half[number, 2]
            na, nb, nc = 0.0, 0.0, 0.0
            if rounds[number]:
                reach = math.sqrt(a * a + b * b)
                if reach - ha > abs(c) - hc:
                    na, nb = a / reach, b / reach
                    s, t = math.atan2(b, a) * ha, c
                else:
                    nc = 1.0 if c > 0 else -1.0
                    s, t = a, b
            elif abs(a) - ha > max(abs(b) - hb, abs(c) - hc):
                na = 1.0 if a > 0 else -1.0
                s, t = b, c
            elif abs(b) - hb > abs(c) - hc:
                nb = 1.0 if b > 0 else -1.0
                s, t = a, c
            else:
                nc = 1.0 if c > 0 else -1.0
                s, t = a, b
            nx, ny = cos * na - sin * nb, sin * na + cos * nb
            kind = surface[number]
            facing = abs(nx * rx + ny * ry + nc * rz) / math.sqrt(rx * rx + ry * ry + rz * rz)
            width = far / fx / max(facing, 0.15)  # of the pixel, on the surface
            level, fine = 0, tiles[kind] / sizes[0]
            while fine < 0.75 * width and level < len(sizes) - 1:
                level, fine = level + 1, 2 * fine
            side = sizes[level]
            i = math.floor(t / tiles[kind] * side) & (side - 1)
            j = math.floor(s / tiles[kind] * side) & (side - 1)
            texel = starts[kind, level] + i * side + j
            red, green, blue = ambient[0], ambient[1], ambient[2]
            for lamp in range(len(directions)):
                lit = -(nx * directions[lamp, 0] + ny * directions[lamp, 1] + nc * directions[lamp, 2])
                if lit > 0:
                    red += lit * colours[lamp, 0]
                    green += lit * colours[lamp, 1]
                    blue += lit * colours[lamp, 2]
            picture[row, column, 0] = min(255.0, texels[texel, 0] * red + 0.5)
            picture[row, column, 1] = min(255.0, texels[texel, 1] * green + 0.5)
            picture[row, column, 2] = min(255.0, texels[texel, 2] * blue + 0.5)
