"""Compiled kinematics of a humanoid: where its bodies, its frames and its centre of mass are, and how they move.

One pass from the base to the tips places the bodies (Huber 2019, eq. 2.111), one back adds up the masses beyond each
joint. Every kernel takes a `toddle.walk.posture.model.Skeleton` and a configuration in MuJoCo's order; results are in
the world's frame. The shapes are the callers' to check.
"""

from __future__ import annotations

import numpy as np
from numba import njit

GRAVITY = 9.81


@njit(cache=True, error_model="numpy")
def turn(rotation, vector, out):
    """out = rotation @ vector."""
    for i in range(3):
        out[i] = rotation[i, 0] * vector[0] + rotation[i, 1] * vector[1] + rotation[i, 2] * vector[2]


@njit(cache=True, error_model="numpy")
def product(a, b, out):
    """out = a @ b, for 3 x 3."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(cache=True, error_model="numpy")
def cross(a, b, out):
    """out = a x b."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def axis_angle(axis, angle, out):
    """Rotation about a unit axis."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    k = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + x * x * k, x * y * k - z * s, x * z * k + y * s
    out[1, 0], out[1, 1], out[1, 2] = y * x * k + z * s, c + y * y * k, y * z * k - x * s
    out[2, 0], out[2, 1], out[2, 2] = z * x * k - y * s, z * y * k + x * s, c + z * z * k


@njit(cache=True, error_model="numpy")
def quaternion_matrix(quaternion, out):
    """Rotation of a quaternion (w, x, y, z) of any length but zero."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    k = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0], out[0, 1], out[0, 2] = 1 - k * (y * y + z * z), k * (x * y - w * z), k * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = k * (x * y + w * z), 1 - k * (x * x + z * z), k * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = k * (x * z - w * y), k * (y * z + w * x), 1 - k * (x * x + y * y)


@njit(cache=True, error_model="numpy")
def place(skeleton, q):
    """All that follows from a configuration, in one pass out and one back.

    Returns:
        Positions (bodies, 3) and rotations (bodies, 3, 3) of the bodies; axes and anchors (joints, 3) of the hinges;
        levers (joints, 3): from an anchor to the centre of the mass beyond it, times its share of the whole mass, so
        that axis x lever is the joint's column of the CoM Jacobian; the centre of mass (3); the whole mass.
    """
    tree = skeleton.tree
    bodies, joints = tree.parent.shape[0], skeleton.lower.shape[0]
    p, rotations = np.empty((bodies, 3)), np.empty((bodies, 3, 3))
    axes, anchors, levers = np.empty((joints, 3)), np.empty((joints, 3)), np.empty((joints, 3))
    beyond, moment = np.empty(bodies), np.empty((bodies, 3))
    rest, spin, arm = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for b in range(bodies):
        if b == 0:
            p[0, :] = q[:3]
            quaternion_matrix(q[3:7], rotations[0])
        else:
            up, joint = tree.parent[b], tree.joint[b]
            turn(rotations[up], tree.position[b], arm)
            for i in range(3):
                p[b, i] = p[up, i] + arm[i]
            if joint < 0:
                product(rotations[up], tree.rotation[b], rotations[b])
            else:
                product(rotations[up], tree.rotation[b], rest)
                turn(rest, tree.axis[b], axes[joint])
                turn(rest, tree.anchor[b], arm)
                for i in range(3):
                    anchors[joint, i] = p[b, i] + arm[i]
                axis_angle(tree.axis[b], q[7 + joint], spin)
                product(rest, spin, rotations[b])
                turn(rotations[b], tree.anchor[b], arm)
                for i in range(3):
                    p[b, i] = anchors[joint, i] - arm[i]
        turn(rotations[b], tree.centre[b], arm)
        beyond[b] = tree.mass[b]
        for i in range(3):
            moment[b, i] = tree.mass[b] * (p[b, i] + arm[i])
    for b in range(bodies - 1, 0, -1):
        up = tree.parent[b]
        beyond[up] += beyond[b]
        for i in range(3):
            moment[up, i] += moment[b, i]
    com = np.empty(3)
    for i in range(3):
        com[i] = moment[0, i] / beyond[0]
    for b in range(1, bodies):
        joint = tree.joint[b]
        if joint >= 0:
            for i in range(3):
                levers[joint, i] = (moment[b, i] - beyond[b] * anchors[joint, i]) / beyond[0]
    return p, rotations, axes, anchors, levers, com, beyond[0]


@njit(cache=True, error_model="numpy")
def place_frames(skeleton, p, rotations):
    """Positions (5, 3) and rotations (5, 3, 3) of the soles, the waist, the chest and the IMU."""
    count = skeleton.frame_body.shape[0]
    at, facing = np.empty((count, 3)), np.empty((count, 3, 3))
    for f in range(count):
        b = skeleton.frame_body[f]
        turn(rotations[b], skeleton.frame_position[f], at[f])
        for i in range(3):
            at[f, i] += p[b, i]
        product(rotations[b], skeleton.frame_rotation[f], facing[f])
    return at, facing


@njit(cache=True, error_model="numpy")
def survey_kernel(skeleton, q):
    """The centre of mass and the poses of the frames."""
    p, rotations, _, _, _, com, _ = place(skeleton, q)
    at, facing = place_frames(skeleton, p, rotations)
    return com, at, facing


@njit(cache=True, error_model="numpy")
def jacobians_kernel(skeleton, q):
    """Jacobians of the centre of mass (3, nv) and of the soles (2, 6, nv), linear rows first."""
    p, rotations, axes, anchors, levers, com, _ = place(skeleton, q)
    at, _ = place_frames(skeleton, p, rotations)
    joints = axes.shape[0]
    of_com, of_soles = np.zeros((3, 6 + joints)), np.zeros((2, 6, 6 + joints))
    column, arm, axis = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        of_com[i, i] = 1.0
        for j in range(3):
            axis[j], arm[j] = rotations[0, j, i], com[j] - p[0, j]
        cross(axis, arm, column)
        of_com[:, 3 + i] = column
        for side in range(2):
            of_soles[side, i, i] = 1.0
            for j in range(3):
                arm[j] = at[side, j] - p[0, j]
            cross(axis, arm, column)
            of_soles[side, :3, 3 + i] = column
            of_soles[side, 3:, 3 + i] = axis
    for joint in range(joints):
        cross(axes[joint], levers[joint], column)
        of_com[:, 6 + joint] = column
        for side in range(2):
            if skeleton.chain[side, joint]:
                for j in range(3):
                    arm[j] = at[side, j] - anchors[joint, j]
                cross(axes[joint], arm, column)
                of_soles[side, :3, 6 + joint] = column
                of_soles[side, 3:, 6 + joint] = axes[joint]
    return of_com, of_soles


@njit(cache=True, error_model="numpy")
def static_kernel(skeleton, q, load, cop):
    """Torques that hold the weight, less those that the floor's upward forces at the centres of pressure give."""
    p, rotations, axes, anchors, levers, _, mass = place(skeleton, q)
    at, facing = place_frames(skeleton, p, rotations)
    torques, point, arm, column = np.empty(axes.shape[0]), np.empty((2, 3)), np.empty(3), np.empty(3)
    for side in range(2):
        for i in range(3):
            point[side, i] = at[side, i] + facing[side, i, 0] * cop[side, 0] + facing[side, i, 1] * cop[side, 1]
    for joint in range(axes.shape[0]):
        cross(axes[joint], levers[joint], column)
        lift = column[2]
        for side in range(2):
            if skeleton.chain[side, joint]:
                for i in range(3):
                    arm[i] = point[side, i] - anchors[joint, i]
                cross(axes[joint], arm, column)
                lift -= load[side] * column[2]
        torques[joint] = mass * GRAVITY * lift
    return torques
