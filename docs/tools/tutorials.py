"""`python -m docs.tools.tutorials [NAME …]`: run the tutorials of docs/tutorials and renew what stands in them.

A page is what runs. A block `sh` is run in a folder of the tutorial's own, a block `python` as a script there; a block
below the comment `<!-- file: NAME -->` is written to that file. The block `text` that follows has lines of the output:
each is replaced by the next line of the new output that begins with the same words, up to two spaces; `…` stays. The
comment `<!-- picture: FILE -->` copies a picture to the one that the next line shows.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

from gudgeon.pipeline.files import write_text

FOLDER = Path(__file__).resolve().parents[1] / "tutorials"
ROOT = FOLDER.parents[1]
PART = re.compile(
    r"(?:<!-- file: (?P<file>\S+) -->\n)?^```(?P<language>sh|text|python|toml)\n(?P<code>.*?)^```$"
    r"|<!-- picture: (?P<source>\S+) -->\n!\[[^]]*\]\((?P<target>\S+)\)",
    re.MULTILINE | re.DOTALL,
)
WIDTH = 1000
"""Of pictures [px]."""


def renewed(text: str, folder: Path) -> str:
    """Run the blocks of a page in a folder, and return the page with the new output.

    Raises:
        SystemExit: a command failed, or its output has no such line.
    """
    output = ""

    def renew(match: re.Match[str]) -> str:
        nonlocal output
        if match["source"]:
            copy_picture(folder / match["source"], FOLDER / match["target"])
        elif match["file"]:
            path = folder / match["file"]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(match["code"], encoding="utf-8")
        elif match["language"] == "text":
            return "\n".join(("```text", *selected(match["code"].splitlines(), output), "```"))
        elif match["language"] == "sh":
            output = printed(["bash", "-ec", match["code"]], folder)
        elif match["language"] == "python":
            output = printed([sys.executable, "-c", match["code"]], folder)
        return match[0]

    return PART.sub(renew, text)


def printed(command: list[str], folder: Path) -> str:
    """Return what a command prints, its errors as well."""
    environment = os.environ | {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "NO_COLOR": "1", "COLUMNS": "120",
    }  # fmt: skip
    done = subprocess.run(
        command, cwd=folder, env=environment, text=True, stdout=-1, stderr=subprocess.STDOUT, check=False
    )
    print(done.stdout, flush=True)
    if done.returncode:
        raise SystemExit(f"{command[-1]}: ended with {done.returncode}")
    return done.stdout


def selected(shown: list[str], output: str) -> Iterator[str]:
    """Yield the lines of an output that begin as those which are shown."""
    lines = iter(output.splitlines())
    for line in shown:
        label = re.split(r"(?<=\S) {2,}", line)[0]
        if line.strip() == "…":
            yield line
            continue
        found = next((new for new in lines if new == label or new.startswith((f"{label}  ", f"{label} "))), None)
        if found is None:
            raise SystemExit(f"the output has no line that begins with '{label}'")
        yield found


def copy_picture(source: Path, target: Path) -> None:
    """Copy a picture at the width of a page."""
    picture = Image.open(source).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)


def main() -> None:
    """Renew all tutorials, or those that are named."""
    for name in sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "README"):
        page = FOLDER / f"{name}.md"
        with tempfile.TemporaryDirectory() as folder:
            write_text(page, renewed(page.read_text(encoding="utf-8"), Path(folder)))


if __name__ == "__main__":
    main()
