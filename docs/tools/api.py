"""`python -m docs.tools.api`: write docs/api.md, the public Python, from signatures and docstrings of the sources."""

import ast
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "api.md"
FACE = "pipeline/gudgeon/__init__.py"
CLASSES = {
    "Scenes": ("pipeline/scenes/bodies.py:SceneFile",),
    "What a run returns": (
        "pipeline/stages/run_report.py:RunReport", "pipeline/stages/run_report.py:StageReport",
        "pipeline/plots/base/frames.py:BodyFrames",
    ),
    "What other functions return": (
        "pipeline/reduction/matrices.py:ComponentMatrices", "pipeline/linear/analysis.py:Answer",
        "pipeline/applications/wear/report.py:WearReport", "pipeline/applications/sensing/calibration.py:Calibration",
        "pipeline/applications/sensing/job.py:Inferred", "pipeline/applications/sensing/identify.py:Parameters",
        "pipeline/applications/sensing/tool.py:Tool",
    ),
    "What a report returns": (
        "pipeline/report/document.py:Document", "pipeline/report/page/notebook.py:ShownReport",
        "pipeline/report/document.py:Run", "pipeline/report/document.py:Quantity", "pipeline/report/document.py:Choice",
        "pipeline/report/document.py:Cost", "pipeline/report/document.py:Budget", "pipeline/report/document.py:Term",
    ),
    "What a study returns": ("pipeline/studies/study.py:StudyReport", "pipeline/studies/family.py:FamilyReport"),
    "Jobs": ("pipeline/stages/job.py:Job", "pipeline/stages/base.py:SceneJob", "pipeline/stages/base.py:Place"),
    "Steps": (
        "solver/simulation.py:Steps", "solver/simulation.py:BodyState", "solver/simulation.py:PortState",
    ),
    "The database": ("modaldb/stores/base.py:Store",),
    "Records": (
        "modaldb/records/mesh.py:MeshRecord", "modaldb/records/modes.py:ModalRecord",
        "modaldb/records/modes.py:MorphRecord", "modaldb/records/trajectory.py:Trajectory",
        "modaldb/records/trajectory.py:ContactHistory", "modaldb/records/labelled.py:Labelled",
    ),
    "Errors": (
        "pipeline/errors.py:PipelineError", "pipeline/errors.py:InputError", "pipeline/errors.py:StageError",
        "modaldb/errors.py:ModalDBError", "modaldb/errors.py:RecordMissing", "modaldb/errors.py:RecordDamaged",
        "modaldb/errors.py:StoreUnusable", "solver/errors.py:SolverError", "solver/errors.py:SceneError",
    ),
}  # fmt: skip
"""Classes by heading, as `file:name`; a private member is not listed."""
HEAD = """# Python interface

Written by `python -m docs.tools.api` from the docstrings. Functions of `import gudgeon` come first, then the classes
that they return. [Python](python.md) shows how they go together.

`Given` is a scene: its folder or TOML file, a mapping of its tables, or a `gudgeon.Scene`. `Changes` are overrides,
texts `path.to.key=value` or a mapping of such paths to values. A `Place` is a path or, for `db`, a URL; None is the
default. The examples run in an empty folder, as a test does.

"""
SECTIONS = ("Args", "Returns", "Raises", "Yields")
WIDE = 100
"""Characters of a signature from which each parameter has a line of its own."""


def homes() -> dict[str, tuple[str, str]]:
    """Return the functions of the package's face: name → file and name there."""
    tree = ast.parse((ROOT / FACE).read_text(encoding="utf-8"))
    table = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "_HOMES"
    )
    found = {}
    for name, home in table.items():
        module, _, member = home.removeprefix("gudgeon.").partition(":")
        path = module.replace(".", "/")
        found[name] = (f"{path}.py" if (ROOT / f"{path}.py").is_file() else f"{path}/__init__.py", member)
    return found


def definition(path: str, name: str) -> ast.FunctionDef | ast.ClassDef:
    """Return the definition of a function or class, also one that a package imports under this name."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return node
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                if (alias.asname or alias.name) == name:
                    below = node.module.removeprefix("gudgeon.").replace(".", "/")
                    return definition(f"{below}.py", alias.name)
    raise ValueError(f"{path}: no {name}")


def unquoted(annotation: ast.expr) -> ast.expr:
    """Return an annotation without the quotes about types that are imported for type checkers alone."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        return ast.parse(annotation.value, mode="eval").body
    if isinstance(annotation, ast.Subscript) and getattr(annotation.value, "id", "") != "Literal":
        annotation.slice = unquoted(annotation.slice)
    elif isinstance(annotation, ast.Tuple):
        annotation.elts = [unquoted(one) for one in annotation.elts]
    elif isinstance(annotation, ast.BinOp):
        annotation.left, annotation.right = unquoted(annotation.left), unquoted(annotation.right)
    return annotation


def type_text(annotation: ast.expr) -> str:
    """Return an annotation as text."""
    return ast.unparse(unquoted(annotation))


def signature(node: ast.FunctionDef, name: str) -> str:
    """Return a function's signature as a block of code; `self` is left out."""
    arguments = node.args
    arguments.args = [one for one in arguments.args if one.arg not in ("self", "cls")]
    for one in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        one.annotation = one.annotation and unquoted(one.annotation)
    returned = "" if node.returns is None else f" -> {type_text(node.returns)}"
    parts = re.split(r", (?=\*|\w+: |\w+=)", ast.unparse(arguments)) if ast.unparse(arguments) else []
    parts = [part.replace("=", " = ", 1) if ": " in part else part for part in parts]
    text = f"{name}({', '.join(parts)}){returned}"
    if len(text) > WIDE:
        text = "\n".join([f"{name}(", *(f"    {part}," for part in parts), f"){returned}"])
    return f"```text\n{text}\n```\n\n"


def prose(text: str | None, what: str) -> str:
    """Return a docstring as Markdown: sections of arguments, results and errors as lists."""
    if not text:
        raise ValueError(f"{what}: no docstring")
    parts, found = [], re.split(rf"^({'|'.join(SECTIONS)}):\n", text, flags=re.MULTILINE)
    parts += [example(text) for text in found[0].strip().split("\n\n")]
    for title, body in zip(found[1::2], found[2::2], strict=True):
        items = list(entries(textwrap.dedent(body).strip()))
        parts.append(f"**{title}**\n\n" + "\n".join(f"- {item}" for item in items))
    return "\n\n".join(parts) + "\n\n"


def example(paragraph: str) -> str:
    """Return a paragraph of a docstring as Markdown; one of examples is a block of code."""
    return f"```python\n{paragraph}\n```" if paragraph.startswith(">>>") else paragraph


def entries(body: str) -> Iterator[str]:
    """Yield the items of a section: `name: text` with its name as code, a plain sentence as it is."""
    for item in re.split(r"\n(?=\S)", body):
        line = re.sub(r"\s*\n\s+", " ", item)
        named = re.match(r"([*\w]+(?:, [*\w]+)*): (.*)", line, re.DOTALL)
        yield line if named is None else f"`{named[1]}`: {named[2]}"


def fields(node: ast.ClassDef) -> Iterator[str]:
    """Yield the fields of a class with their types and what stands below them."""
    for one, after in zip(node.body, [*node.body[1:], None], strict=True):
        if not isinstance(one, ast.AnnAssign) or not isinstance(one.target, ast.Name) or one.target.id.startswith("_"):
            continue
        text = described(one.value)
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str):
            text = " ".join(after.value.value.split())
        yield f"- `{one.target.id}: {type_text(one.annotation)}`" + (f": {text}" if text else "")


def described(value: ast.expr | None) -> str:
    """Return the description of a key of a table, `Field(description="…")`; nothing of other fields."""
    words = value.keywords if isinstance(value, ast.Call) and getattr(value.func, "id", "") == "Field" else []
    return next((ast.literal_eval(word.value) for word in words if word.arg == "description"), "")


def members(node: ast.ClassDef) -> Iterator[ast.FunctionDef]:
    """Yield the public methods and properties of a class; what is described at its base has no docstring of its own."""
    for one in node.body:
        if (
            isinstance(one, ast.FunctionDef)
            and not one.name.startswith("_")
            and (ast.get_docstring(one) or not node.bases)
        ):
            yield one


def is_property(node: ast.FunctionDef) -> bool:
    """Whether a method is read as an attribute."""
    return any("property" in ast.unparse(one) for one in node.decorator_list)


def class_text(path: str, name: str) -> str:
    """Return the part of a class: docstring, fields, methods."""
    node = definition(path, name)
    assert isinstance(node, ast.ClassDef)
    module = f"gudgeon.{path.removesuffix('.py').replace('/', '.')}"
    bases = [base.id for base in node.bases if isinstance(base, ast.Name)]
    shown = {one.rpartition(":")[2] for group in CLASSES.values() for one in group}
    above = "".join(f" It has the members of `{base}`, too." for base in bases if base in shown)
    parts = [f"### {name}\n\n", prose(ast.get_docstring(node), name).rstrip() + f"{above} Module `{module}`.\n\n"]
    if listed := list(fields(node)):
        parts.append("\n".join(listed) + "\n\n")
    for one in members(node):
        if is_property(one):
            returned = "" if one.returns is None else type_text(one.returns)
            parts.append(f"```text\n{name}.{one.name}: {returned}\n```\n\n")
        else:
            parts.append(signature(one, f"{name}.{one.name}"))
        parts.append(prose(ast.get_docstring(one), f"{name}.{one.name}"))
    return "".join(parts)


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD, "## Functions\n\n"]
    for name, (path, member) in homes().items():
        node = definition(path, member)
        if isinstance(node, ast.ClassDef):  # It is among the classes.
            parts.append(f"### gudgeon.{name}\n\nThe class [{node.name}](#{node.name.lower()}).\n\n")
            continue
        parts.append(f"### gudgeon.{name}\n\n{signature(node, f'gudgeon.{name}')}")
        parts.append(prose(ast.get_docstring(node), name))
    for title, group in CLASSES.items():
        parts.append(f"## {title}\n\n")
        parts += [class_text(*one.split(":")) for one in group]
    return "".join(parts).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
