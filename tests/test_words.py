"""One word for each thing: retired words stand in no text of the product. docs/glossary.md has the terms.

Searched are names, strings, docstrings and comments of the product, scenes, documents and the page's script; of the
glossary all but the column that lists what a term replaces. Free: the changelog, libraries (`vendor/`), references
(`*.json`, which carry their sources' words), and pointers into references.
"""

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
RETIRED = {
    "impact": r"blows?|knock(s|ed|ing)?|episodes?",
    "full FE": r"nodal synthes[ei]s|nodal dofs",
    "reduction": r"recipes?",
    "update": r"rungs?",
    "robustness": r"gudgeon stress|\[stress(?=[.\]])|extremes",
    "conservative error": r"sound[ _]errors?",
    "impulse": r"kick(s|ed|ing)?",
    "small": r"trapezoid",
    "energy balance": r"books|booked|less work",
    "counts": r"tally|tallies|tallied",
    "slap energy": r"slap impulses?",
    "has an error of": r"errs( by)?",
    "corrects, refine": r"mends?|mended|mending",
    "displacement_x, rotation_x, angular_velocity_x": r"(?:shift|turn|spin)_[xyz]",
    "wear_volume, wear_angle, wear_indentation": r"worn_(?:volume|angle)|rubbed_indentation",
    "joint_truncation, inertia_truncation": r"(?:joint|inertia)_lacks?",
    "approach_speed, separation_speed": r"impact(?:\d+|N)\.(?:closing|opening)",
}
"""Patterns by the term that takes their place; a part of a longer name counts as a word."""
IN_DOCUMENTS = {
    "next to, in addition to, against": r"beside",
    "does not have, does not represent": r"(?<!_)lack(?:s|ing)?",
    "given, stated": r"told",
    "deforms, displacement": r"yields|gives? way",
    "is, has": r"stands(?! for)",
    "what is, not what was": r"loads? of \d|load average|earlier (?:runs?|versions?|commits?)|this commit",
}
"""Retired in hand-written documents, which say what is in the field's words."""
IN_MESSAGES = {
    "next to, in addition to, against": r"beside",
    "do not represent, are missing": r"(?<!_)lack(?:s|ing)?",
    "given, determined": r"told|tells",
    "deforms": r"yields|gives? way",
}
"""Retired in strings of the product with several words: messages, notes and help. Docstrings are not among them."""
VAGUE = re.compile(
    r"apart|asked|at|begin|first|found|given|held|here|inside|kept|known|last|least|left|less|lost|more|most|near|"
    r"now|number|one|other|over|own|part|parts|place|places|pressed|pull|push|pushed|reach|rest|share|told|wanted|"
    r"way|what|where|whole"
)
"""Names that do not say what they are: neither the quantity nor the thing."""
VAGUE_NAMES = 354
"""How many bound names of the product are among them at most. The number only falls: who names better lowers it."""
WRITTEN_BY_TOOLS = ("api", "gallery", "quantities", "scene-reference")
SEARCHED = ("modaldb/*.py", "pipeline/*.py", "pipeline/*.toml", "pipeline/*.js", "pipeline/*.css", "solver/*.py",
            "data/*.toml", "tests/validation/scenes/*.toml", "docs/*.md", "docs/*.py", "README.md",
            "CONTRIBUTING.md", "Makefile")  # fmt: skip


FREE = ("pipeline/service/page/vendor/", "docs/verification/")
"""Libraries, and pages that have the words of the references."""


def pattern(words: str) -> re.Pattern[str]:
    """Match words, also as parts of `snake_case` and `CamelCase` names."""
    return re.compile(rf"(?<![A-Za-z])(?:{words})(?![a-z])", re.IGNORECASE)


def offenders(path: str, text: str, retired: dict[str, str] = RETIRED) -> list[str]:
    """List the lines of a text that hold a retired word."""
    glossary = path == "docs/glossary.md"
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        line = "|".join(line.split("|")[:3]) if glossary else line.replace("/episodes/", "")
        for term, words in retired.items():
            if (match := pattern(words).search(line)) is not None:
                found.append(f"{path}:{number}: '{match[0]}', say {term}")
    return found


def searched() -> list[str]:
    """Return the files of the product that are searched, by their path from the root."""
    listed = subprocess.run(["git", "ls-files", *SEARCHED], cwd=ROOT, capture_output=True, text=True, check=True)
    return [path for path in listed.stdout.splitlines() if (ROOT / path).is_file() and not path.startswith(FREE)]


def test_retired_words_stand_nowhere() -> None:
    assert [line for path in searched() for line in offenders(path, (ROOT / path).read_text())] == []


def test_hand_written_documents_have_the_words_of_the_field() -> None:
    pages = [path for path in searched() if path.endswith(".md") and Path(path).stem not in WRITTEN_BY_TOOLS]
    assert len(pages) > 30
    assert [line for path in pages for line in offenders(path, (ROOT / path).read_text(), IN_DOCUMENTS)] == []


def messages(text: str) -> str:
    """Return the strings of a source that have several words, a line each, without docstrings."""
    tree = ast.parse(text)
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    constants = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docstrings)
    return "\n".join(c.value for c in constants if isinstance(c.value, str) and " " in c.value.strip())


def test_messages_have_the_words_of_the_field() -> None:
    sources = [path for path in searched() if path.endswith(".py") and not path.startswith("docs/")]
    assert len(sources) > 300
    texts = {path: messages((ROOT / path).read_text()) for path in sources}
    assert [line for path, text in texts.items() for line in offenders(path, text, IN_MESSAGES)] == []


def test_a_retired_word_of_messages_is_found() -> None:
    text = '"""The modes lack it."""\nraise ValueError(f"{name}: a file beside it")\n'
    assert len(offenders("a.py", messages(text), IN_MESSAGES)) == 1


@pytest.mark.parametrize("line", ["beside the run", "modes lack it", "at a load of 3 on two cores", "the bore yields"])
def test_a_retired_word_of_documents_is_found(line: str) -> None:
    assert len(offenders("docs/a.md", line, IN_DOCUMENTS)) == 1


@pytest.mark.parametrize(
    "line",
    ["a blow", "PER_BLOW = 1", "first_blow", "Blows of a contact", "the recipe", "integrator = 'kick'", "Trapezoid",
     "gudgeon stress data/skirt", "[stress.case.a]", "sound_error", "all nodal dofs", "step_tally", "it errs by 1 %",
     "a finer mesh mends it", "energy less work", "beam.spin_y", "pin.impact1.closing", "rod.joint_lack"],
)  # fmt: skip
def test_a_retired_word_is_found(line: str) -> None:
    assert len(offenders("a.py", line)) == 1


@pytest.mark.parametrize(
    "line",
    ["the trapezoidal rule", "blowing", "a steady state", "von Mises stress", "nodal positions", "unless workers stop",
     '"euler_bernoulli/episodes/0/Fmax"', "recommends"],
)  # fmt: skip
def test_a_term_of_the_field_is_let_through(line: str) -> None:
    assert offenders("a.py", line) == []


def test_the_glossary_has_the_terms() -> None:
    text = (ROOT / "docs/glossary.md").read_text()
    assert [term for term in list(RETIRED)[:10] if term not in text] == []


def bound_names(text: str) -> list[str]:
    """Return the names that a source binds: targets of assignments, loops and comprehensions, and arguments."""
    nodes = list(ast.walk(ast.parse(text)))
    targets = [node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    return targets + [node.arg for node in nodes if isinstance(node, ast.arg)]


def test_vague_names_only_become_fewer() -> None:
    sources = [(ROOT / path).read_text() for path in searched() if path.endswith(".py") and path[:5] != "docs/"]
    count = sum(VAGUE.fullmatch(name) is not None for text in sources for name in bound_names(text))
    assert VAGUE_NAMES - 50 < count <= VAGUE_NAMES


def test_bound_names_are_targets_and_arguments() -> None:
    text = (
        "def f(one, *, kept=1):\n    for part in one:\n        found: int = [other for other in part]\n    return own\n"
    )
    assert sorted(bound_names(text)) == ["found", "kept", "one", "other", "part"]
