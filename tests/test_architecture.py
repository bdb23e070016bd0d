"""The arrows of the design: who may import whom, and who may touch the world.

Each rule is proven by a planted fault that `arrows.faults` must find.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, cast

import jax.numpy as jnp
import pytest
from arrows import faults
from jax.dtypes import TypePromotionError

SOURCE = Path(__file__).parents[1] / "src" / "toddle"


def test_the_tree_keeps_the_design() -> None:
    assert faults(SOURCE) == []


def test_a_tree_that_keeps_the_design_has_no_fault(tmp_path: Path) -> None:
    _plant(tmp_path, "reach/loop.py", "import numpy as np\nfrom toddle.robots import body\nopen('a.txt')")
    _plant(tmp_path, "robots/__init__.py", "import importlib\nimportlib.import_module(f'{__name__}.{part}')")
    _plant(tmp_path, "robots/strangers.py", "importlib.import_module(f'robot_descriptions.{name}')")
    _plant(tmp_path, "robots/body.py", "from toddle.signals import Movement\nimport mujoco")
    _plant(tmp_path, "signals.py", "from toddle.failures import BadInput\nfrom .geometry import frames")
    _plant(tmp_path, "geometry/frames.py", "text = 'pickle'.replace('a', 'b')")
    _plant(tmp_path, "outside/pictures.py", "import matplotlib.pyplot\nfrom toddle.reach import loop\nprint(1)")
    _plant(tmp_path, "failures.py", "")
    assert faults(tmp_path) == []


PLANTS = {
    "geometry knows signals": ("geometry/frames.py", "from toddle import signals", "geometry may not import"),
    "signals know robots": (
        "signals.py",
        "from toddle.robots.body import Body",
        "signals may not import robots",
    ),
    "robots know a skill": ("robots/chain.py", "import toddle.reach.loop", "robots may not import reach"),
    "one skill knows another": ("walk/loop.py", "from toddle.see import depth", "walk may not import see"),
    "a skill knows the outside": (
        "reach/loop.py",
        "from ..outside import page",
        "reach may not import outside",
    ),
    "outside knows an experiment": (
        "outside/page.py",
        "import toddle.experiments",
        "outside may not import exp",
    ),
    "an experiment knows the cli": ("experiments/a.py", "from toddle.cli import main", "may not import cli"),
    "the door is used from within": (
        "reach/loop.py",
        "from toddle import load",
        "reach may not import toddle itself",
    ),
    "failures know anything": (
        "failures.py",
        "from toddle.geometry import x",
        "failures may not import geometry",
    ),
    "hidden in a function": (
        "reach/a.py",
        "def f():\n    import toddle.outside.page",
        "a.py:2: reach may not",
    ),
    "hidden behind a string": (
        "reach/a.py",
        "import importlib\nimportlib.import_module('x')",
        "hides an arrow",
    ),
    "hidden behind a name": ("reach/a.py", "importlib.import_module(name)", "hides an arrow"),
    "hidden behind our name": ("reach/a.py", "importlib.import_module(f'toddle.{name}')", "hides an arrow"),
    "hidden behind half a name": ("reach/a.py", "importlib.import_module(f'{package}.a')", "hides an arrow"),
    "mujoco in a skill": ("reach/loop.py", "import mujoco", "mujoco is imported only in"),
    "mujoco in the page": ("outside/page.py", "from mujoco import viewer", "mujoco is imported only in"),
    "a plot in the learner": (
        "reach/learn/a.py",
        "from matplotlib import pyplot",
        "matplotlib is imported only",
    ),
    "a table in an experiment": ("experiments/a.py", "import rich.table", "rich is imported only"),
    "weights in a skill": ("reach/a.py", "import safetensors.numpy", "safetensors is imported only"),
    "a socket in a robot": ("robots/a.py", "import socket", "socket is imported only"),
    "a print in a skill": ("reach/a.py", "print('hello')", "a terminal is touched only"),
    "a file written": ("reach/a.py", "path.write_text('hello')", "a file is written only"),
    "a file opened to write": (
        "robots/a.py",
        "with open(path, mode='ab') as f: pass",
        "a file is written only",
    ),
    "pickle": ("outside/a.py", "def f():\n    import pickle", "a.py:2: pickle runs"),
    "pickle inside numpy": ("outside/a.py", "np.load(path, allow_pickle=True)", "pickle runs"),
    "eval": ("cli/a.py", "eval('1')", "eval runs"),
    "exec": ("outside/a.py", "exec('x = 1')", "exec runs"),
    "a folder of no idea": ("reach/utils/a.py", "", "named for no idea"),
    "a file of no idea": ("geometry/helpers.py", "", "named for no idea"),
    "a place of no design": ("magic/a.py", "", "magic has no place in the design"),
    "a cycle": (
        "robots/a.py",
        "from toddle.robots import b",
        "import cycle: robots.a -> robots.b -> robots.a",
    ),
}


@pytest.mark.parametrize(("path", "text", "expected"), PLANTS.values(), ids=PLANTS.keys())
def test_a_planted_fault_is_found(tmp_path: Path, path: str, text: str, expected: str) -> None:
    _plant(tmp_path, "robots/b.py", "from toddle.robots.a import name")
    _plant(tmp_path, path, text)
    found = faults(tmp_path)
    assert len(found) == 1
    assert expected in found[0]


def test_a_cycle_closed_inside_a_function_is_none(tmp_path: Path) -> None:
    _plant(tmp_path, "robots/a.py", "def f():\n    from toddle.robots import b")
    _plant(tmp_path, "robots/b.py", "from toddle.robots import a")
    assert faults(tmp_path) == []


def test_a_wrong_shape_is_found_where_it_is_made() -> None:
    from jaxtyping import TypeCheckError

    from toddle.robots.chain import z_motion

    with pytest.raises(TypeCheckError):
        z_motion(jnp.zeros(3), jnp.zeros(()))


def test_a_wrong_type_is_found_where_it_is_made() -> None:
    from jaxtyping import TypeCheckError

    from toddle.failures import unknown_name

    with pytest.raises(TypeCheckError):
        unknown_name("robot", cast(Any, 3), ["nicu"])


def test_a_warning_is_an_error() -> None:
    with pytest.raises(UserWarning, match="planted"):
        warnings.warn("planted", UserWarning, stacklevel=1)


def test_silent_promotion_is_refused() -> None:
    with pytest.raises(TypePromotionError, match="promotion"):
        jnp.add(jnp.ones(2, dtype=jnp.int32), jnp.ones(2))
    with pytest.raises(ValueError, match="promotion"):
        jnp.add(jnp.ones(2), jnp.ones((2, 2)))


def _plant(tree: Path, path: str, text: str) -> None:
    (tree / path).parent.mkdir(parents=True, exist_ok=True)
    (tree / path).write_text(text)
