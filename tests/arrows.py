"""Reads a source tree, never runs it, and tells every breach of the design: `faults`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

# geometry <- signals <- robots <- { reach, walk, see, navigate } <- outside <- experiments, cli; "": toddle
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
    if "import_module" in (name, method) and module.top not in ("cli", "") and not _tells_its_package(call):
        return "a dynamic import hides an arrow"
    if module.top in EDGE:
        return ""
    if name in ("print", "input"):
        return f"{name}: a terminal is touched only in {', '.join(EDGE)}"
    if method in WRITES or ("open" in (name, method) and _writes(call)):
        return f"{method or name}: a file is written only in {', '.join(EDGE)}"
    return ""


def _tells_its_package(call: ast.Call) -> bool:
    """Whether a dynamic import stays in its own package (``f"{__name__}.{part}"``) or in a stranger's."""
    named = ast.unparse(call.args[0]).lstrip("f").strip("'\"") if call.args else ""
    top, dot, _ = named.partition(".")
    return top == "{__name__}" or (
        bool(dot) and top.isidentifier() and top not in {"toddle", *ONLY_IN, *UNSAFE_MODULES}
    )


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
