"""A skill as a file: learned once, then used by programs that know nothing of toddle.

python examples/exported_skill.py        (the first half needs toddle[export]; the second onnxruntime, or jax)
"""

import json
import tempfile
from pathlib import Path

import numpy as np


def learn_and_export(folder: Path) -> None:
    import toddle
    from toddle.outside.export import export

    skill = toddle.learn("nicu", noise=0.001, samples=150, test_points=200)
    assert isinstance(skill, toddle.BodySkill)  # it learned its body, not the inverse
    export(skill, folder / "skill.onnx")
    export(skill, folder / "skill.jax")


def by_onnx(file: Path, targets: np.ndarray) -> np.ndarray:
    import onnxruntime

    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    facts = session.get_modelmeta().custom_metadata_map
    joints, distance = map(np.asarray, session.run(["joints", "distance"], {"target": targets}))
    print(f"{facts['joints']}: expected error {1000 * float(facts['expected_error_m']):.2f} mm")
    print(f"reached: {distance < 1e-4}")
    return joints


def by_jax(file: Path, targets: np.ndarray) -> np.ndarray:
    import jax

    exported = jax.export.deserialize(bytearray(file.read_bytes()))
    facts = json.loads(exported.fun_name)
    answer = jax.jit(exported.call)(targets)
    print(f"{facts['joints']}: expected error {1000 * facts['expected_error_m']:.2f} mm")
    print(f"reached: {answer['distance'] < 1e-4}")
    return np.asarray(answer["joints"])


with tempfile.TemporaryDirectory() as folder:
    learn_and_export(Path(folder))
    targets = np.array([[0.22, -0.27, 0.58], [0.27, -0.33, 0.81], [2.0, 0.0, 0.0]], np.float32)  # [m], base frame
    print(by_onnx(Path(folder) / "skill.onnx", targets).round(3))
    print(by_jax(Path(folder) / "skill.jax", targets).round(3))
