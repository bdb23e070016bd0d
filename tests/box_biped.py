"""A biped of boxes and capsules for physics, with servos, sensors and solid soles: 24.8 kg, ten joints, no file."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from walk.biped import tree_of

from toddle.robots.gait import Gait
from toddle.robots.humanoid import Frame, Humanoid

SIDES = ("left", "right")
JOINTS = tuple(
    f"{side}_{joint}" for side in SIDES for joint in ("hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")
)
THIGH, SHANK, ANKLE, BEND = 0.24, 0.2, 0.06, 0.4

_LEG = """
<body name="{side}_hip" pos="0 {y} 0">
  <joint name="{side}_hip_roll" axis="1 0 0" range="-.5 .5"/>
  <inertial mass=".5" pos="0 0 0" diaginertia=".001 .001 .001"/>
  <body name="{side}_thigh">
    <joint name="{side}_hip_pitch" axis="0 1 0" range="-1.5 1"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.24" size=".04" mass="2" contype="0" conaffinity="2"/>
    <body name="{side}_shank" pos="0 0 -.24">
      <joint name="{side}_knee" axis="0 1 0" range="-.05 2"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.2" size=".035" mass="1.5" contype="0" conaffinity="2"/>
      <body name="{side}_ankle" pos="0 0 -.2">
        <joint name="{side}_ankle_pitch" axis="0 1 0" range="-.9 .9"/>
        <inertial mass=".3" pos="0 0 0" diaginertia=".001 .001 .001"/>
        <body name="{side}_foot">
          <joint name="{side}_ankle_roll" axis="1 0 0" range="-.4 .4"/>
          <geom name="{side}_sole" type="box" pos=".03 0 -.055" size=".1 .05 .005" mass=".6"/>
          <site name="{side}_sole" pos="0 0 -.06"/>
        </body>
      </body>
    </body>
  </body>
</body>"""

_WHOLE = """
<mujoco>
  <compiler angle="radian"/>
  <default><joint armature=".1"/></default>
  <worldbody>
    <body name="base" pos="0 0 .5">
      <freejoint name="floating_base"/>
      <geom type="box" size=".06 .09 .05" pos="0 0 .05" mass="5" contype="0" conaffinity="2"/>
      <geom type="box" size=".07 .1 .1" pos="0 0 .25" mass="10" contype="0" conaffinity="2"/>
      <site name="waist"/><site name="imu" pos="0 0 .3"/><site name="chest" pos="0 0 .2"/>
      {legs}
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
  <sensor>
    {feet}
    <gyro name="gyro" site="imu"/>
    <accelerometer name="accelerometer" site="imu"/>
    <framequat name="orientation" objtype="site" objname="imu"/>
  </sensor>
</mujoco>"""


def biped() -> Humanoid:
    """The biped, standing with its knees bent."""
    servo = '<position name="{0}" joint="{0}" kp="3000" kv="60" forcerange="-40 40"/>'
    foot = '<force name="{0}_force" site="{0}_sole"/><torque name="{0}_torque" site="{0}_sole"/>'
    legs = "".join(_LEG.format(side=side, y=y) for side, y in zip(SIDES, (0.07, -0.07), strict=True))
    servos, feet = "".join(map(servo.format, JOINTS)), "".join(map(foot.format, SIDES))
    spec = mujoco.MjSpec.from_string(_WHOLE.format(legs=legs, servos=servos, feet=feet))
    model = spec.copy().compile()
    limits = np.array([model.joint(name).range for name in JOINTS])
    count, height = len(JOINTS), (THIGH + SHANK) * math.cos(BEND) + ANKLE
    return Humanoid(
        name="biped",
        tree=tree_of(model),
        joints=JOINTS,
        lower=limits[:, 0],
        upper=limits[:, 1],
        effort=np.full(count, 40.0),
        stiffness=np.full(count, 3000.0),
        damping=np.full(count, 60.0),
        moves=np.ones(count, bool),
        home=np.array([(SHANK - THIGH) * math.sin(BEND), 0, height, 1, 0, 0, 0, *biped_home()]),
        soles=(_frame(model, "left_sole"), _frame(model, "right_sole")),
        waist=_frame(model, "waist"),
        chest=_frame(model, "chest"),
        imu=_frame(model, "imu"),
        gait=Gait(com_height=0.488, foot_distance=0.14, foot_length=0.2, foot_width=0.1, foot_ahead=0.03),
        spec=spec,
    )


def swaying(t: float) -> np.ndarray:
    """Servo targets that sway the biped from side to side and to and fro, feet flat [rad]."""
    servo = biped_home()
    grown = min(t, 1.0)
    roll, pitch = 0.1 * grown * math.sin(3.8 * t), 0.02 * grown * math.sin(5.0 * t)
    for leg in (0, 5):
        servo[leg] += roll
        servo[leg + 4] -= roll
        servo[leg + 3] += pitch
    return servo


def biped_home() -> np.ndarray:
    """Joint angles of the standing biped [rad]."""
    return np.array(2 * [0.0, -BEND, 2 * BEND, -BEND, 0.0])


def _frame(model: mujoco.MjModel, name: str) -> Frame:
    return Frame(int(model.site(name).bodyid[0]) - 1, model.site(name).pos.copy(), np.eye(3))
