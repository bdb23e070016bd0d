"""The arrows of the design: who may import whom, and who may touch the world.

`faults` reads a source tree and never runs it. Each rule is proven by a planted fault that it must find.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import jax.numpy as jnp
import pytest
from jax.dtypes import TypePromotionError

SOURCE = Path(__file__).parents[1] / "src" / "toddle"

# geometry <- signals <- robots <- { reach, walk, see, navigate } <- outside <- experiments, cli ("": toddle itself)
RANK = {
    "geometry": 0, "signals": 1, "robots": 2, "reach": 3, "walk": 3, "see": 3, "navigate": 3,
    "outside": 4, "experiments": 5, "cli": 6, "": 7, "__main__": 7,
}  # fmt: skip
EDGE = ("outside", "cli")
ONLY_IN = {
    "mujoco": ("robots", "outside.simulation", "outside.doctor"),
    **dict.fromkeys(("matplotlib", "PIL", "rich", "tyro", "safetensors", "socket", "http", "urllib"), EDGE),
    **dict.fromkeys(("subprocess", "tempfile", "shutil", "threading", "signal"), EDGE),
}
WRITES = {
    "write_text", "write_bytes", "mkdir", "makedirs", "touch", "unlink", "rmdir", "savefig", "savez",
    "savez_compressed", "savetxt", "tofile", "symlink_to",
}  # fmt: skip
UNSAFE_MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "marshal", "shelve"}
UNSAFE_CALLS = {"eval", "exec", "compile", "__import__"}
NAMES_OF_NO_IDEA = {"utils", "util", "core", "common", "misc", "helpers", "helper", "shared", "lib"}


@dataclass(frozen=True)
class Module:
    name: str  # "reach.loop"; "" for toddle/__init__.py
    path: Path
    tree: ast.Module
    is_package: bool

    @property
    def top(self) -> str:
        return self.name.partition(".")[0]

    def within(self, places: tuple[str, ...]) -> bool:
        return any(self.name == place or self.name.startswith(place + ".") for place in places)


def faults(source: Path) -> list[str]:
    """Every breach of the design in a source tree, as ``file:line: what``."""
    modules = {module.name: module for module in _modules(source)}
    found = [f"{path}: a folder or file named for no idea" for path in _badly_named(source)]
    for module in modules.values():
        where = module.path.relative_to(source)
        found += [f"{where}:{line}: {what}" for line, what in _breaches(module, modules)]
    cycle = _cycle({name: _toddle_imports(module, modules) for name, module in modules.items()})
    return found + ([f"import cycle: {' -> '.join(cycle)}"] if cycle else [])


def _modules(source: Path) -> Iterator[Module]:
    for path in sorted(source.rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        is_package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_package else parts)
        yield Module(name, path, ast.parse(path.read_text()), is_package)


def _badly_named(source: Path) -> list[Path]:
    paths = [path.relative_to(source) for path in source.rglob("*") if path.is_dir() or path.suffix == ".py"]
    return [path for path in paths if path.stem in NAMES_OF_NO_IDEA]


def _breaches(module: Module, modules: dict[str, Module]) -> Iterator[tuple[int, str]]:
    if module.top != "failures" and module.top not in RANK:
        yield 1, f"{module.top} has no place in the design"
        return
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            for target in _targets(node, module):
                what = _forbidden_import(module, target, modules)
                if what:
                    yield node.lineno, what
        elif isinstance(node, ast.Call):
            what = _forbidden_call(module, node)
            if what:
                yield node.lineno, what


def _targets(node: ast.Import | ast.ImportFrom, module: Module) -> list[str]:
    """What a statement imports, by absolute name; each name of ``from a import b`` as ``a.b``."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    base = node.module or ""
    if node.level:
        own = ["toddle", *filter(None, module.name.split("."))]
        up = node.level - module.is_package
        base = ".".join([*own[: len(own) - up], *filter(None, [base])])
    return [f"{base}.{alias.name}" for alias in node.names]


def _forbidden_import(module: Module, target: str, modules: dict[str, Module]) -> str:
    top = target.partition(".")[0]
    if top in UNSAFE_MODULES:
        return f"{top} runs what a stranger wrote"
    if top in ONLY_IN and not module.within(ONLY_IN[top]):
        return f"{top} is imported only in {', '.join(ONLY_IN[top])}"
    if top != "toddle":
        return ""
    other = _module_of(target, modules).partition(".")[0]
    if other == module.top or other == "failures":
        return ""
    if module.top == "failures" or RANK.get(other, 99) >= RANK[module.top]:
        return f"{module.top} may not import {other or 'toddle itself'}"
    return ""


def _forbidden_call(module: Module, call: ast.Call) -> str:
    name = call.func.id if isinstance(call.func, ast.Name) else ""
    method = call.func.attr if isinstance(call.func, ast.Attribute) else ""
    if name in UNSAFE_CALLS:
        return f"{name} runs what a stranger wrote"
    if any(keyword.arg == "allow_pickle" for keyword in call.keywords):
        return "pickle runs what a stranger wrote"
    if "import_module" in (name, method) and module.top not in ("cli", "") and not _stays_inside(call):
        return "a dynamic import hides an arrow"
    if module.top in EDGE:
        return ""
    if name in ("print", "input"):
        return f"{name}: a terminal is touched only in {', '.join(EDGE)}"
    if method in WRITES or ("open" in (name, method) and _writes(call)):
        return f"{method or name}: a file is written only in {', '.join(EDGE)}"
    return ""


def _stays_inside(call: ast.Call) -> bool:
    """Whether a dynamic import names a module below its own package: ``f"{__name__}.{module}"``."""
    return bool(call.args) and ast.unparse(call.args[0]).startswith("f'{__name__}.")


def _writes(call: ast.Call) -> bool:
    given = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "mode")]
    modes = [word.value for word in given if isinstance(word, ast.Constant) and isinstance(word.value, str)]
    return any(set(mode) <= set("rwaxbt+") and set(mode) & set("wax+") for mode in modes)


def _module_of(target: str, modules: dict[str, Module]) -> str:
    """The longest beginning of ``toddle.a.b.name`` that is a module; else its first name."""
    parts = target.split(".")[1:]
    for length in range(len(parts), 0, -1):
        if ".".join(parts[:length]) in modules:
            return ".".join(parts[:length])
    return parts[0] if parts and parts[0] in RANK else ""


def _toddle_imports(module: Module, modules: dict[str, Module]) -> set[str]:
    """The modules that are imported when this one is: not within a function, not for type checking only."""
    found: set[str] = set()
    waiting: list[ast.AST] = list(module.tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            targets = [target for target in _targets(node, module) if target.partition(".")[0] == "toddle"]
            found |= {_module_of(target, modules) for target in targets} - {module.name}
        waiting.extend(ast.iter_child_nodes(node))
    return found


def _cycle(graph: dict[str, set[str]]) -> list[str]:
    """One cycle of a graph, its first node repeated at its end; empty where there is none."""
    done: set[str] = set()

    def walk(node: str, path: list[str]) -> list[str]:
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        for following in sorted(graph.get(node, ())):
            found = walk(following, [*path, node])
            if found:
                return found
        done.add(node)
        return []

    return next((found for node in sorted(graph) if (found := walk(node, []))), [])


def test_the_tree_keeps_the_design() -> None:
    assert faults(SOURCE) == []


def test_a_tree_that_keeps_the_design_has_no_fault(tmp_path: Path) -> None:
    _plant(tmp_path, "reach/loop.py", "import numpy as np\nfrom toddle.robots import body\nopen('a.txt')")
    _plant(tmp_path, "robots/__init__.py", "import importlib\nimportlib.import_module(f'{__name__}.{part}')")
    _plant(tmp_path, "robots/body.py", "from toddle.signals import Movement\nimport mujoco")
    _plant(tmp_path, "signals.py", "from toddle.failures import BadInput\nfrom .geometry import frames")
    _plant(tmp_path, "geometry/frames.py", "text = 'pickle'.replace('a', 'b')")
    _plant(
        tmp_path, "outside/pictures.py", "import matplotlib.pyplot\nfrom toddle.reach import loop\nprint(1)"
    )
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
