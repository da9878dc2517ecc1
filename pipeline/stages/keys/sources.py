"""Digests of the sources that shape the products of each stage, so that no key outlives the code that made its record.

A digest covers the modules that a stage's own import, directly or not, without comments and docstrings, and the sources
of the compiled code that these call, as the extension says of itself; it is the same on every machine, level of
instructions and Python version. To find it takes a second, so digests are kept in the user's cache folder
(`solver.source_state`).
"""

import ast
import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from gudgeon.solver import core
from gudgeon.solver.source_state import PACKAGES, ROOT, kept_digests

BODIES, FIELD, WHEEL = "pipeline.stages.bodies", "pipeline.applications.electrostatics", "pipeline.applications.wheel"
RECORDS = {
    "mesh": ("pipeline.stages.mesh", "pipeline.design_change.morph", f"{BODIES}:make_mesh"),
    "modes": ("pipeline.reduction.reduce", "pipeline.reduction.designs", f"{BODIES}:make_modes"),
    "morph": ("pipeline.design_change.morph", "pipeline.design_change.design", "pipeline.stages.mesh",
              f"{BODIES}:make_morph"),
    "solve": ("solver.system.compile", "solver.simulate", f"{BODIES}:make_run"),
}  # fmt: skip
ROOTS: dict[str, tuple[str, ...]] = {
    **RECORDS,
    "sensitivity": ("pipeline.design_change.estimate", "pipeline.design_change.design"),
    "plot": ("pipeline.plots", f"{WHEEL}.pictures", f"{FIELD}.pictures"),
    "nodal": ("pipeline.nodal.scene.problem", "pipeline.nodal.sliding.loop", "pipeline.stages.mesh",
              "pipeline.nodal.scene.runs:_timed"),
    "cyclic": (f"{WHEEL}.response", "pipeline.stages.mesh", f"{WHEEL}.job:make_modes"),
    "wheel": (f"{WHEEL}.response", "pipeline.stages.mesh", f"{WHEEL}.job:make_response"),
    "field": (f"{FIELD}.capacitance", f"{FIELD}.conductors", "pipeline.stages.mesh", f"{FIELD}.stages:compute_field"),
    "poses": (f"{FIELD}.poses", f"{FIELD}.blocks"),
    "posegrid": (f"{FIELD}.poses", f"{FIELD}.blocks"),
    "measurement": (*(root for roots in RECORDS.values() for root in roots), "pipeline.report.timing"),
    "report": ("pipeline.report.sweep", "pipeline.report.errors", "pipeline.report.choice"),
}  # fmt: skip
"""Where the code of each stage begins; `module:name` is one function, of a module that serves several stages."""
OUTSIDE = ("modaldb", "pipeline.errors", "pipeline.files", "pipeline.process", "pipeline.plots", "pipeline.stages",
           "solver.errors", "solver.source_state")  # fmt: skip
"""Rooms that shape no number: they keep, order, draw, time or report. They count where they are roots."""
INSIDE = ("modaldb.records",)
"""Rooms within those that do."""
NAME = re.compile(r"gudgeon((?:\.\w+)+)(?::\w+)?")


CORE = "solver.core"
"""The extension; a module that imports it calls the compiled sources of its own folder, or else those of the core."""


@cache
def code_digests(root: Path = ROOT, compiled: str | None = None) -> Mapping[str, str]:
    """Return the digest of each stage's sources, 16 digits, for the packages in a folder.

    Args:
        root: The folder.
        compiled: Digests of the compiled sources by their paths, as JSON; None: those of the extension in use.
    """
    digests: str = core.module.sources if compiled is None else compiled

    def found() -> Mapping[str, str]:
        modules = Modules(source_texts(root), json.loads(digests))
        return {stage: modules.digest(stage) for stage in ROOTS}

    name = f"sources-{hashlib.sha256(digests.encode()).hexdigest()[:8]}"
    return kept_digests(_cache_folder(), name, ROOTS, found, root)


def source_texts(root: Path) -> dict[str, bytes]:
    """Return the source of every module in a folder, by its name without `gudgeon.`."""
    paths = (path for package in PACKAGES for path in sorted((root / package).rglob("*.py")))
    names = ((path.relative_to(root).as_posix().removesuffix(".py"), path) for path in paths)
    return {name.removesuffix("/__init__").replace("/", "."): path.read_bytes() for name, path in names}


class Modules:
    """Modules by name, parsed when they are needed.

    Args:
        texts: As `source_texts` returns them.
        compiled: Digests of compiled sources by their paths.
    """

    def __init__(self, texts: Mapping[str, bytes], compiled: Mapping[str, str]) -> None:
        self._texts, self._compiled = texts, compiled
        self._trees: dict[str, ast.Module] = {}
        self._digests: dict[str, str] = {}
        self._imports: dict[str, list[str]] = {}

    def digest(self, stage: str) -> str:
        """Return the digest of a stage's sources."""
        total = hashlib.sha256()
        for name in self.covered(stage):
            if name not in self._digests:
                self._digests[name] = hashlib.sha256(canonical(self._part(name)).encode()).hexdigest()
            total.update(f"{name} {self._digests[name]}\n".encode())
        for path in self.compiled(stage):
            total.update(f"{path} {self._compiled[path]}\n".encode())
        return total.hexdigest()[:16]

    def compiled(self, stage: str) -> list[str]:
        """Return the paths of the compiled sources that a stage's digest covers, sorted."""
        paths = set[str]()
        for name in self.covered(stage):
            if CORE in self._imports.get(name, ()):
                folder = name.rpartition(".")[0].replace(".", "/")
                beside = [path for path in self._compiled if path.rpartition("/")[0] == folder]
                paths.update(beside or (path for path in self._compiled if path.startswith(CORE.replace(".", "/"))))
        return sorted(paths)

    def covered(self, stage: str) -> list[str]:
        """Return the modules and functions that a stage's digest covers, sorted."""
        names, waiting = set(), list(ROOTS[stage])
        within = (*INSIDE, *ROOTS[stage])
        while waiting:
            name = waiting.pop()
            if name not in names:
                names.add(name)
                if name not in self._imports:
                    self._imports[name] = [] if ":" in name else list(self._imported(name))
                waiting += [n for n in self._imports[name] if _within(n, within) or not _within(n, OUTSIDE)]
        return sorted(names)

    def _tree(self, name: str) -> ast.Module:
        if name not in self._trees:
            self._trees[name] = ast.parse(self._texts[name])
        return self._trees[name]

    def _part(self, name: str) -> ast.AST:
        module, _, function = name.partition(":")
        body = self._tree(module).body
        if not function:
            return self._tree(module)
        return next(node for node in body if isinstance(node, ast.FunctionDef) and node.name == function)

    def _imported(self, name: str) -> Iterator[str]:
        """Yield the project's modules that a module imports, also within functions and by their names in texts."""
        for node in _running(self._tree(name)):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.JoinedStr):
                yield from self._below(node)
                continue
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and NAME.fullmatch(node.value):
                names = [node.value.replace(":", ".")]
            else:
                continue
            for imported in names:
                if imported.startswith("gudgeon."):
                    yield from self._own(imported.removeprefix("gudgeon."))

    def _below(self, text: ast.JoinedStr) -> Iterator[str]:
        """Yield all modules that an f-string such as `gudgeon.solver.integrators.{name}` can name."""
        start = getattr(text.values[0], "value", None) if text.values else None
        if isinstance(start, str) and start.startswith("gudgeon."):
            prefix = start.removeprefix("gudgeon.")
            yield from (name for name in self._texts if name.startswith(prefix))

    def _own(self, name: str) -> Iterator[str]:
        """Yield the module that a name is or stands in."""
        while name and name not in self._texts:
            name = name.rpartition(".")[0]
        if name:
            yield name


def canonical(node: ast.AST) -> str:
    """Return a tree as text without docstrings, places in the file, and fields that are empty."""
    texts: list[str] = []
    _describe(node, texts)
    return "".join(texts)


def _describe(item: Any, texts: list[str]) -> None:
    if isinstance(item, ast.AST):
        texts.append(f"({type(item).__name__}")
        for name in item._fields:
            value = getattr(item, name, None)
            if name == "body" and isinstance(value, list):
                # A text that stands alone is a docstring, of a field too.
                value = [v for v in value if not _is_text(v)]
            if (value is None and name != "value") or value == [] or name in ("ctx", "kind", "type_comment"):
                continue
            texts.append(f" {name}=")
            _describe(value, texts)
        texts.append(")")
    elif isinstance(item, list):
        for member in item:
            texts.append(",")
            _describe(member, texts)
    else:
        texts.append(repr(item))


def _is_text(statement: Any) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _running(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree but those that only a type checker sees."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            waiting += node.orelse
            continue
        yield node
        waiting += ast.iter_child_nodes(node)


def _within(module: str, rooms: tuple[str, ...]) -> bool:
    return any(module == room or module.startswith(f"{room}.") for room in rooms)


def _cache_folder() -> Path:
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gudgeon"
    except RuntimeError:  # A user without a home directory.
        return Path("/nonexistent")
