"""Your own robot: any URDF or MJCF file, from babbling to an answer.

python examples/own_arm.py
"""

import tempfile
from pathlib import Path

import toddle

URDF = """
<robot name="desk_arm">
  <link name="table"/> <link name="turret"/> <link name="upper"/> <link name="lower"/> <link name="pen"/>
  <joint name="turn" type="revolute">
    <parent link="table"/> <child link="turret"/> <origin xyz="0 0 0.06"/> <axis xyz="0 0 1"/>
    <limit lower="-1.2" upper="1.2"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <parent link="turret"/> <child link="upper"/> <origin xyz="0 0 0.05"/> <axis xyz="0 1 0"/>
    <limit lower="0" upper="1.4"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/> <child link="lower"/> <origin xyz="0 0 0.15"/> <axis xyz="0 1 0"/>
    <limit lower="0.1" upper="1.5"/>
  </joint>
  <joint name="grip" type="fixed">
    <parent link="lower"/> <child link="pen"/> <origin xyz="0 0 0.18"/>
  </joint>
</robot>
"""

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "desk_arm.urdf"
    file.write_text(URDF)
    robot = toddle.load(file, tip="pen")

skill = toddle.learn(robot, samples=20_000, hidden=(20,), seed=0)
target = skill.targets[0]
answer = toddle.solve(skill, target, robot=robot)
print(f"target {target.round(3)} m: joints {answer.q.round(3)} rad, {answer.verdict} ({answer.reason})")
