import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from scipy.spatial.transform import Rotation

from toddle.failures import BadInput
from toddle.outside.movement_log import read_movements

HEAD = "t,shoulder,elbow,tip_x,tip_y,tip_z\n"


def write(tmp_path, text, name="movements.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_joints_are_found_by_name_in_the_order_asked_for(tmp_path):
    path = write(tmp_path, HEAD + "0,1,2,0.1,0.2,0.3\n1,3,4,0.4,0.5,0.6\n")
    log = read_movements(path, ("elbow", "shoulder"))
    assert log.joints == ("elbow", "shoulder")
    np.testing.assert_allclose(log.experience.q, [[2, 1], [4, 3]])
    np.testing.assert_allclose(log.experience.x, [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    assert log.experience.turn is None


def test_without_a_robot_every_other_column_is_a_joint(tmp_path):
    assert read_movements(write(tmp_path, HEAD + "0,1,2,0.1,0.2,0.3\n")).joints == ("shoulder", "elbow")


def test_quaternions_of_a_parquet_file_become_rotations(tmp_path):
    turns = Rotation.random(5, rng=np.random.default_rng(1))
    x, y, z, w = turns.as_quat().T
    zeros = np.zeros(5)
    table = {"a": zeros, "x": zeros, "y": zeros, "z": zeros, "qw": w, "qx": x, "qy": y, "qz": z}
    path = tmp_path / "movements.parquet"
    pyarrow.parquet.write_table(pa.table(table), path)
    seen = read_movements(path).experience.turn
    assert seen is not None
    np.testing.assert_allclose(seen, turns.as_matrix(), atol=1e-12)


def test_rows_with_gaps_are_left_out_and_told(tmp_path):
    log = read_movements(write(tmp_path, HEAD + "0,1,2,0.1,,0.3\n1,3,4,0.4,0.5,0.6\n2,nan,4,0.4,0.5,0.6\n"))
    assert len(log.experience.q) == 1
    assert log.notes == ("2 of 3 rows have gaps and are left out (row 1, 3)",)


@pytest.mark.parametrize(
    ("text", "joints", "told"),
    [
        ("", None, "can't be read"),
        ("a,b\n1,2\n", None, "position is missing"),
        ("a,x,z\n1,2,3\n", None, "position is missing"),
        ("x,y,z\n1,2,3\n", None, "no column of a joint"),
        ("a,x,y,z,qw\n1,2,3,4,1\n", None, "only qw"),
        ("a,x,y,z,qw,qx,qy,qz\n1,2,3,4,1,1,0,0\n", None, "row 1 has length 1.41"),
        ("a,x,y,z\nhello,2,3,4\n", None, "isn't numbers"),
        ("a,x,y,z\n,2,3,4\n", None, "no row is complete"),
        ("a,x,y,z,tip_x\n1,2,3,4,5\n", None, "same name"),
        ("wrist,x,y,z\n1,2,3,4\n", ("shoulder", "elbow"), "the robot's are shoulder, elbow"),
        ("elbov,shoulder,x,y,z\n1,1,2,3,4\n", ("shoulder", "elbow"), "did you mean elbov"),
    ],
)
def test_what_can_t_be_used_is_one_line(tmp_path, text, joints, told):
    with pytest.raises(BadInput, match=told) as caught:
        read_movements(write(tmp_path, text), joints)
    assert "\n" not in caught.value.line
    assert "movements.csv" in caught.value.line


def test_files_that_are_none(tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        read_movements(tmp_path / "none.csv")
    with pytest.raises(BadInput, match=r"ends with '\.txt'"):
        read_movements(write(tmp_path, "a", "a.txt"))
    with pytest.raises(BadInput, match="can't be read"):
        read_movements(write(tmp_path, "a", "a.parquet"))
