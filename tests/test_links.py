"""Every relative link and anchor of every document leads to a file of the repository and a heading in it."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def listed(*patterns: str) -> list[str]:
    """Return the files of the repository, by their path from the root."""
    found = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True)
    return found.stdout.splitlines()


def anchors(text: str) -> set[str]:
    """Return the anchors of a document's headings, as GitHub makes them; code in fences has none."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ +(.+?) *$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken(path: Path, text: str, files: set[Path]) -> list[str]:
    """Return the links of a document that lead nowhere; those to the web are not followed."""
    found = []
    for link in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = link.partition("#")
        target = (path.parent / place).resolve() if place else path
        if target not in files and not any(target in file.parents for file in files):
            found.append(f"{link}: no such file")
        elif anchor and anchor not in anchors(text if target == path else target.read_text(encoding="utf-8")):
            found.append(f"{link}: no such heading")
    return found


@pytest.mark.parametrize("name", listed("*.md"))
def test_links_lead_to_files_and_headings(name: str) -> None:
    files = {ROOT / one for one in listed()}
    assert broken(ROOT / name, (ROOT / name).read_text(encoding="utf-8"), files) == []


def test_broken_links_are_found(tmp_path: Path) -> None:
    page, other = tmp_path / "page.md", tmp_path / "docs" / "other.md"
    other.parent.mkdir()
    other.write_text("# A `heading`, told\n", encoding="utf-8")
    text = "[a](docs/other.md#a-heading-told) [b](docs) [c](https://x.org/y) [d](gone.md) [e](docs/other.md#b) [f](#g)"
    assert broken(page, text, {page, other}) == ["gone.md: no such file", "docs/other.md#b: no such heading",
                                                 "#g: no such heading"]  # fmt: skip
