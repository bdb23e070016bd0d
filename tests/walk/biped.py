"""A small biped that loads in a moment: 14 hinges, skewed bodies and offset hinges, so that no error can hide."""

from __future__ import annotations

import functools

import mujoco
import numpy as np

from toddle.robots.gait import Gait
from toddle.robots.humanoid import Frame, Humanoid, Tree

_LEG = """
<body name="{s}_hip" pos="0 {y} -0.05" euler=".035 0 0"><inertial pos="0 0 -.02" mass=".6" diaginertia=".01 .01 .01"/>
 <joint name="{s}_hip_yaw" axis="0 0 1" range="-.8 .8"/>
 <body name="{s}_hip2" pos="0 0 -.03"><inertial pos=".01 0 0" mass=".5" diaginertia=".01 .01 .01"/>
  <joint name="{s}_hip_roll" axis="1 0 0" range="-.5 .5"/>
  <body name="{s}_thigh" pos=".005 0 0"><inertial pos="0 {o} -.1" mass="2" diaginertia=".02 .02 .01"/>
   <joint name="{s}_hip_pitch" axis="0 1 0" pos="0 0 .01" range="-1.6 .8"/>
   <body name="{s}_shank" pos="0 0 -.22"><inertial pos=".01 0 -.1" mass="1.5" diaginertia=".02 .02 .01"/>
    <joint name="{s}_knee" axis="0 1 0" range="0 2"/>
    <body name="{s}_ankle" pos="0 0 -.2"><inertial pos="0 0 0" mass=".3" diaginertia=".01 .01 .01"/>
     <joint name="{s}_ankle_pitch" axis="0 1 0" range="-1.1 .8"/>
     <body name="{s}_foot" pos="0 0 -.01"><inertial pos=".02 0 -.03" mass=".8" diaginertia=".01 .01 .01"/>
      <joint name="{s}_ankle_roll" axis="1 0 0" pos="0 0 .01" range="-.5 .5"/>
      <site name="{s}_sole" pos="0 0 -.05" euler="-.035 0 0"/>
      <geom name="{s}_sole" type="box" size=".09 .05 .005" pos=".02 0 -.045"/>
     </body></body></body></body></body></body>"""

MJCF = f"""
<mujoco><compiler angle="radian" autolimits="true"/><option timestep="0.002"/>
<default><joint type="hinge"/><geom mass="0"/></default>
<worldbody><body name="pelvis" pos="0 0 .6"><freejoint name="floating_base"/>
 <inertial pos="-.01 0 .02" mass="5" diaginertia=".05 .05 .05"/>
 <site name="waist" pos="0 0 0" euler="0 0 0"/>
 {_LEG.format(s="left", y=0.07, o=0.005)}
 <body name="belly" pos="0 0 .08"><inertial pos="0 0 .02" mass="1" diaginertia=".02 .02 .02"/>
  <joint name="torso_pitch" axis="0 1 0" range="-.5 .9"/>
  <body name="trunk" pos=".01 0 .05"><inertial pos="0 0 .12" mass="8" diaginertia=".1 .1 .05"/>
   <joint name="torso_yaw" axis="0 0 1" range="-.8 .8"/>
   <site name="chest" pos="0 0 .15"/><site name="imu" pos=".03 .01 .1" euler=".2 .3 .5"/>
   <body name="arm" pos="0 .15 .2"><inertial pos="0 0 -.1" mass="1.2" diaginertia=".01 .01 .01"/>
    <joint name="arm" axis="0 1 0" range="-2 2"/></body>
  </body></body>
 {_LEG.format(s="right", y=-0.07, o=-0.005)}
</body></worldbody></mujoco>"""


def _frame(model: mujoco.MjModel, name: str) -> Frame:
    site = model.site(name)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, site.quat)
    return Frame(int(site.bodyid[0]) - 1, site.pos.copy(), matrix.reshape(3, 3))


def tree_of(model: mujoco.MjModel) -> Tree:
    """MuJoCo's bodies without the world; joints are counted after the free one."""
    bodies = model.nbody - 1
    rotation, axis, anchor = np.zeros((bodies, 9)), np.zeros((bodies, 3)), np.zeros((bodies, 3))
    joint = np.full(bodies, -1)
    for b in range(bodies):
        mujoco.mju_quat2Mat(rotation[b], model.body_quat[b + 1])
        first = model.body_jntadr[b + 1]
        if first > 0:
            joint[b], axis[b], anchor[b] = first - 1, model.jnt_axis[first], model.jnt_pos[first]
    return Tree(
        parent=model.body_parentid[1:].astype(np.int64) - 1,
        position=model.body_pos[1:].copy(),
        rotation=rotation.reshape(-1, 3, 3),
        axis=axis,
        anchor=anchor,
        joint=joint,
        mass=model.body_mass[1:].copy(),
        centre=model.body_ipos[1:].copy(),
    )


@functools.cache
def biped() -> Humanoid:
    """Stands with bent knees; its arm is held."""
    spec = mujoco.MjSpec.from_string(MJCF)
    model = spec.compile()
    joints = tuple(model.joint(i).name for i in range(1, model.njnt))
    home = np.zeros(model.nq)
    home[:7] = 0, 0, 0.5, 1, 0, 0, 0
    for side in ("left", "right"):
        for name, angle in (("hip_pitch", -0.45), ("knee", 0.9), ("ankle_pitch", -0.45)):
            home[7 + joints.index(f"{side}_{name}")] = angle
    data = mujoco.MjData(model)
    data.qpos[:] = home
    mujoco.mj_forward(model, data)
    home[2] -= data.site("left_sole").xpos[2]
    return Humanoid(
        name="biped",
        tree=tree_of(model),
        joints=joints,
        lower=model.jnt_range[1:, 0].copy(),
        upper=model.jnt_range[1:, 1].copy(),
        effort=np.full(len(joints), 50.0),
        stiffness=np.full(len(joints), 3000.0),
        damping=np.full(len(joints), 60.0),
        moves=np.array([name != "arm" for name in joints]),
        home=home,
        soles=(_frame(model, "left_sole"), _frame(model, "right_sole")),
        waist=_frame(model, "waist"),
        chest=_frame(model, "chest"),
        imu=_frame(model, "imu"),
        gait=Gait(com_height=0.42, foot_distance=0.14, foot_length=0.18, foot_width=0.1),
        spec=spec,
    )
