"""What holds for every robot of the catalogue, and how names become robots."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle import robots
from toddle.failures import BadInput, MissingExtra
from toddle.robots import packages
from toddle.robots.body import Body
from toddle.robots.catalogue import MODELS
from toddle.robots.chain import Chain
from toddle.robots.continuum import Continuum

SPECS = [name.replace(":N", ":5") for name in robots.names()] + ["planar:20"]


@pytest.fixture(scope="module", params=SPECS)
def body(request: pytest.FixtureRequest) -> Body:
    return robots.load(request.param)


@eqx.filter_jit
def _batch(body: Body, q: jax.Array) -> jax.Array:
    return jax.vmap(body.forward)(q)


@eqx.filter_jit
def _jacobian(body: Body, q: jax.Array) -> tuple[jax.Array, jax.Array]:
    """By jacfwd, and by central differences."""
    h = 1e-6
    steps = h * jnp.eye(q.size, dtype=q.dtype)
    above, below = jnp.split(jax.vmap(body.forward)(q[None] + jnp.concatenate([steps, -steps])), 2)
    return jax.jacfwd(body.forward)(q), (above - below).T / (2 * h)


@eqx.filter_jit
def _alone(body: Body, q: jax.Array) -> jax.Array:
    return body.forward(q)


def _some_q(body: Body) -> jax.Array:
    lower, upper = np.asarray(body.lower), np.asarray(body.upper)
    return jnp.asarray(np.random.default_rng(0).uniform(lower, upper, (4, len(lower))), jnp.float32)


def test_names_limits_and_home_fit_together(body: Body) -> None:
    count = len(body.joints)
    assert len(set(body.joints)) == count
    assert body.lower.shape == body.upper.shape == body.home.shape == (count,)
    assert body.lower.dtype == body.upper.dtype == body.home.dtype == jnp.float32
    assert np.all(np.asarray(body.lower) < np.asarray(body.upper))
    assert np.all((np.asarray(body.lower) <= np.asarray(body.home)) & (np.asarray(body.home) <= np.asarray(body.upper)))


def test_forward_is_finite_and_the_same_alone_and_in_a_batch(body: Body) -> None:
    q = _some_q(body)
    batch = np.asarray(_batch(body, q))
    assert batch.shape == (4, body.space)
    assert batch.dtype == np.float32
    assert np.all(np.isfinite(batch))
    np.testing.assert_allclose(np.asarray(_alone(body, q[0])), batch[0], atol=1e-6)


def test_every_joint_moves_the_tip_or_turns_it(body: Body) -> None:
    """The Jacobian against central differences, in double precision."""
    with jax.enable_x64(True):
        double = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), body)
        by_rule, by_difference = _jacobian(double, jnp.asarray(np.asarray(_some_q(body)[0], dtype=np.float64)))
    np.testing.assert_allclose(np.asarray(by_rule), np.asarray(by_difference), atol=1e-8)
    still = [joint for joint, column in zip(body.joints, np.asarray(by_rule).T, strict=True) if not column.any()]
    assert still == (["theta_3"] if body.name == "scara" else [])


def test_the_position_is_that_of_the_pose(body: Body) -> None:
    assert isinstance(body, Chain | Continuum)
    q, coordinates = _some_q(body)[0], list(body.coordinates if isinstance(body, Chain) else (0, 1, 2))
    pose = np.asarray(eqx.filter_jit(lambda b, v: b.pose(v))(body, q))
    np.testing.assert_allclose(np.asarray(_alone(body, q)), pose[coordinates, 3], atol=1e-6)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=2e-6)


def _packed(points: np.ndarray, apart: float) -> int:
    kept = np.empty((0, 3))
    for point in points:
        if not len(kept) or np.linalg.norm(kept - point, axis=1).min() >= apart:
            kept = np.vstack([kept, point])
    return len(kept)


@pytest.mark.parametrize("spec", ["nicu-wide", "suralp-wide"])
def test_an_arm_has_room_for_the_documents_test_points(spec: str) -> None:
    """Taken greedily from random postures; with the ranges read as total spans a quarter would fit."""
    record, body = robots.record(spec), robots.load(spec)
    assert record is not None
    lower, upper = np.asarray(body.lower), np.asarray(body.upper)
    q = np.random.default_rng(0).uniform(lower, upper, (8000, len(lower))).astype(np.float32)
    assert _packed(np.asarray(_batch(body, jnp.asarray(q))), record.test_spacing) >= record.test_points

    middle, half = (lower + upper) / 2, (upper - lower) / 2
    narrow = (middle + (q - middle) * np.float32(0.5)).astype(np.float32)
    assert half.min() > 0
    assert _packed(np.asarray(_batch(body, jnp.asarray(narrow))), record.test_spacing) < 0.5 * record.test_points


@pytest.mark.parametrize("file", sorted(MODELS.glob("*.urdf")), ids=lambda path: path.stem)
def test_our_models_say_what_is_a_guess_and_name_their_source(file: Path) -> None:
    assert "Guessed:" in file.read_text()
    assert "Read:" in file.read_text()
    assert f"`{file.name}`" in (MODELS / "README.md").read_text()
    record = robots.record(file.stem)
    assert record is not None
    assert record.file == file


def test_every_record_says_what_it_is() -> None:
    assert {"nicu", "suralp", "icub_arm", "planar:N", "planar3", "scara", "bha"} <= set(robots.names())
    for record in robots.describe():
        assert record.about
        assert record.source
        assert robots.record(record.name.replace(":N", ":7")) is record
    assert robots.record("nobody") is None


def test_part_of_an_arm_can_be_chosen() -> None:
    arm = robots.load("nicu", tip="forearm", joints=["arm_x", "shoulder_z"])
    assert arm.joints == ("shoulder_z", "arm_x")
    for spec in ("planar:5", "scara", "bha"):
        with pytest.raises(BadInput, match=f"{spec}: its tip can't be chosen; leave tip out"):
            robots.load(spec, tip="hand")


def test_a_joint_that_is_not_chosen_stays_at_zero_or_as_near_as_it_can(tmp_path: Path) -> None:
    text = (MODELS / "nicu.urdf").read_text()
    path = tmp_path / "nicu.urdf"
    path.write_text(text.replace('lower="-0.1745329" upper="0.1745329"', 'lower="0.2" upper="0.3"'))
    part, whole = robots.load(path, joints=["arm_x"]), robots.load("nicu")
    x = whole.forward(jnp.array([0.0, 0.2, 0.7, 0.0]))
    np.testing.assert_allclose(np.asarray(part.forward(jnp.array([0.7]))), np.asarray(x), atol=1e-6)


def test_the_root_element_decides_and_not_the_files_name(tmp_path: Path) -> None:
    urdf, mjcf = tmp_path / "arm.xml", tmp_path / "arm.urdf"
    urdf.write_text((MODELS / "suralp.urdf").read_text())
    mjcf.write_text('<mujoco><worldbody><body name="a"><joint name="one"/><site name="s"/></body></worldbody></mujoco>')
    assert robots.load(urdf).joints == robots.load("suralp").joints
    assert robots.load(str(mjcf), tip="s").joints == ("one",)


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        ("nikku", "no robot named 'nikku'; did you mean nicu"),
        ("", "no robot named ''"),
        ("planar", "N is ''; give a number of joints, such as planar:5"),
        ("panda", "2 robots called 'panda'; name one: panda_description, panda_mj_description"),
        ("pandaa_description", "did you mean panda_description"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(spec: str, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    known = {"panda_description": 0, "panda_mj_description": 0, "iiwa14_description": 0}
    monkeypatch.setattr(packages, "descriptions", lambda: known)
    with pytest.raises(BadInput) as caught:
        robots.load(spec)
    assert says in str(caught.value)


def test_missing_packages_are_named_with_the_command_that_installs_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "icub_models", None)
    with pytest.raises(MissingExtra, match=r"icub-models.*pip install 'toddle\[icub\]'"):
        robots.load("icub_arm")
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    with pytest.raises(MissingExtra, match=r"pip install 'toddle\[descriptions\]'"):
        robots.load("panda_mj_description")
    with pytest.raises(BadInput, match="no robot named 'panda'"):
        robots.load("panda")


def _describe_as(monkeypatch: pytest.MonkeyPatch, module: Callable[[str], object]) -> None:
    monkeypatch.setattr(packages, "descriptions", lambda: {"iiwa_description": 0})
    monkeypatch.setattr(packages, "importlib", SimpleNamespace(import_module=module))


def test_a_described_robot_is_read_from_where_its_package_put_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def module(name: str) -> object:
        print("Cloning", name)
        found = ModuleType(name)
        found.__dict__["URDF_PATH"] = str(MODELS / "suralp.urdf")
        return found

    _describe_as(monkeypatch, module)
    assert robots.load("iiwa").joints == robots.load("iiwa_description").joints == robots.load("suralp").joints
    assert capsys.readouterr().out == ""


def test_a_robot_that_cannot_be_fetched_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def module(name: str) -> object:
        raise OSError("git failed\n  fatal: could not resolve host\n")

    _describe_as(monkeypatch, module)
    with pytest.raises(BadInput, match=r"fatal: could not resolve host.*check the network") as caught:
        robots.load("iiwa")
    assert "\n" not in str(caught.value)
    _describe_as(monkeypatch, ModuleType)
    with pytest.raises(BadInput, match="neither a URDF nor an MJCF"):
        robots.load("iiwa")


def test_importing_and_listing_loads_nothing_heavy() -> None:
    code = (
        "import sys; from toddle import robots; robots.describe(); robots.names(); "
        "print({'jax', 'mujoco', 'numpy', 'icub_models', 'robot_descriptions'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "set()"


def test_a_body_is_a_frozen_value() -> None:
    body = robots.load("planar:3")
    with pytest.raises(AttributeError):
        body.lower = body.upper  # pyright: ignore[reportAttributeAccessIssue]
    assert isinstance(body, Chain)
    assert replace(body, name="other").name == "other"
