"""`python -m docs.tools.theory_manual`: write the theory manual as one PDF, out/theory.pdf, by headless Chromium."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from docs.tools.equations import FOLDER, chapters, completed, held_back

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LINK = re.compile(r'href="(?!https?:|#)([^"#]*)#?([^"]*)"')
STYLE = """
@page { size: A4; margin: 18mm 19mm; }
body { font: 9.8pt/1.36 "Noto Serif", "DejaVu Serif", serif; color: #1f2933; margin: 0; }
h1 { font-size: 19pt; break-before: page; margin-top: 0; }
h2 { font-size: 13pt; } h1, h2 { font-family: "DejaVu Sans", sans-serif; break-after: avoid; }
a { color: inherit; text-decoration: none; }
img { width: 88%; display: block; margin: auto; } p:has(img) { break-inside: avoid; break-after: avoid; }
p:has(> em:only-child) { font-size: 8.6pt; margin: 0 6%; }
table { border-collapse: collapse; width: 100%; font-size: 8.6pt; } tr, .equation { break-inside: avoid; }
td, th { border-bottom: 0.4pt solid #8a949e; text-align: left; padding: 2pt 6pt 2pt 0; vertical-align: top; }
code { font-size: 88%; }
"""


def browser() -> str:
    """Return the path of Chromium.

    Raises:
        SystemExit: it is not installed.
    """
    for name in BROWSERS:
        if (path := shutil.which(name)) is not None:
            return path
    sys.exit("theory manual: Chromium is missing: run `make browser`")


def inner_link(match: re.Match[str]) -> str:
    """Return a link to another page as one within the manual, or to the repository's file where it is none of it."""
    name, anchor = match[1], match[2]
    pages = {path.name: number for number, path in chapters().items()}
    if name not in pages:
        return ""
    return f'href="#{anchor or f"chapter-{pages[name]}"}"'


def page(number: str, path: Path) -> str:
    """Return the HTML of a chapter."""
    from markdown import markdown  # Of the extra `docs`.

    text, pictures = held_back(path.read_text(encoding="utf-8"))
    # The line that leads to the pages before and after is of no use on paper.
    text = re.sub(r"^\[Symbols\].*$", "", text, count=1, flags=re.MULTILINE)
    html = completed(markdown(text, extensions=["tables", "toc"]), pictures, "#eq-{number}")
    html = html.replace('src="', f'src="{FOLDER.as_uri()}/')
    return f'<section id="chapter-{number}">{LINK.sub(inner_link, html)}</section>'


def manual() -> str:
    """Return the whole manual as HTML."""
    style = STYLE + (FOLDER / "equations.css").read_text(encoding="utf-8")
    body = "\n".join(page(number, path) for number, path in chapters().items())
    return f'<!doctype html><meta charset="utf-8"><title>Gudgeon: theory manual</title><style>{style}</style>{body}'


def main() -> None:
    """Write the PDF."""
    chromium, target = browser(), OUT / "theory.pdf"
    OUT.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "theory.html")
        source.write_text(manual(), encoding="utf-8")
        command = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer",
                   f"--user-data-dir={folder}/profile", f"--print-to-pdf={target}", source.as_uri()]  # fmt: skip
        subprocess.run(command, check=True, capture_output=True, timeout=300)
    print(f"theory manual: {target.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
