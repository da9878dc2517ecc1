"""`python -m docs.tools.pictures [FILE …]` (`make pictures`): run the scenes that the documents picture, copy their
pictures to docs, and write below each, on every page that shows it, what it says of itself.

A picture carries all that is written in it as its PNG description, see `plots.base.style.save`; its second part, the
subtitle, is the caption. `tests/test_docs_pictures.py` compares captions and figures of pages with it without a run.
"""

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from gudgeon.pipeline.files import write_text

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
OUT = ROOT / "out" / "pictures"
WIDTH = 1000
"""Of pictures on pages [px]."""
KEY = "Description"


class Source(NamedTuple):
    """Where a picture of the documents comes from."""

    scene: str
    """Folder or file within data/."""
    file: str
    """That a run of it draws, or film and share of its length, `impact.mp4@0.5`."""
    changes: tuple[str, ...] = ()
    """As `--set` takes them."""


PICTURES: Mapping[str, Source] = {
    "gallery/rod-wall.png": Source("rod-wall", "deformation.png"),
    "gallery/two-mass.png": Source("two-mass", "impacts.png"),
    "gallery/hertz.png": Source("hertz", "force.png"),
    "gallery/held-ball.png": Source("held-ball", "force.png"),
    "gallery/pendulum.png": Source("pendulum/large.toml", "mechanism.png"),
    "gallery/two-blocks.png": Source("two-blocks", "deformation-anvil.png"),
    "gallery/fork.png": Source("fork", "deformation.png"),
    "gallery/held-beam.png": Source("held-beam", "deformation.png"),
    "gallery/rod-mass.png": Source("rod-mass", "deformation.png"),
    "gallery/elastic-slider-crank.png": Source("elastic-slider-crank", "mechanism.png"),
    "gallery/gears.png": Source("gears", "line-loads.png"),
    "gallery/pull-in.png": Source("pull-in/field.toml", "charge.png"),
    "gallery/rods-3d.png": Source("rods-3d", "force.png"),
    "impacts.png": Source("beam-sphere", "impacts.png"),
    "stress.png": Source("skirt", "stress.png", ("component.skirt.gauge.skin.surface=skin",)),
    "mems-assembly.png": Source("mems-assembly", "impact.mp4@0.58"),
    "deformation.png": Source("piston", "deformation.png"),
    "piston-force.png": Source("piston", "force.png"),
}
"""Pictures of runs, by their file in docs; the other pictures there are written by the tools of their own pages."""


def run(source: Source, folder: Path) -> None:
    """Run a scene into a folder; what is fresh is not computed again.

    Raises:
        SystemExit: the run failed.
    """
    command = [sys.executable, "-m", "gudgeon.pipeline", "run", str(ROOT / "data" / source.scene), "--out", str(folder)]
    for change in source.changes:
        command += ["--set", change]
    if subprocess.run(command, cwd=ROOT, env=os.environ | {"NO_COLOR": "1"}, stdout=sys.stderr).returncode:
        raise SystemExit(f"{source.scene}: the run failed")


def described(path: Path) -> str:
    """Return what is written in a picture, a line each; empty of one without a description."""
    with Image.open(path) as picture:
        return str(picture.info.get(KEY, ""))


def copy(source: Path, target: Path) -> None:
    """Copy a picture at the width of a page, with its description."""
    info, text = PngInfo(), described(source)
    info.add_itxt(KEY, text)
    picture = Image.open(source).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    target.parent.mkdir(parents=True, exist_ok=True)
    picture.save(target, optimize=True, pnginfo=info)


def copy_frame(film: Path, fraction: float, target: Path) -> None:
    """Write a frame of a film, at a fraction of its length."""
    import imageio.v3

    frames = imageio.v3.imread(film)
    Image.fromarray(frames[round(fraction * (len(frames) - 1))]).save(target, optimize=True)


def caption(picture: Path) -> str:
    """Return the subtitle of a picture as one line; empty of one without a description."""
    lines = described(picture).splitlines()
    return re.sub(r"\s+·\s+", " · ", lines[1]).strip() if len(lines) > 1 else ""


def captioned(text: str, folder: Path) -> str:
    """Return the text of a page in a folder with the captions of the pictures of runs that it shows."""

    def renew(match: re.Match[str]) -> str:
        picture = (folder / match["file"]).resolve()
        name = picture.relative_to(DOCS).as_posix() if picture.is_relative_to(DOCS) else ""
        line = caption(picture) if name in PICTURES and picture.exists() else ""
        return f"{match['image']}\n" + (f"*{line}*\n" if line else "")

    pattern = r"^(?P<image>!\[[^\]]*\]\((?P<file>[^)]+\.png)\))\n(?:\*[^*\n]+\*\n)?"
    return re.sub(pattern, renew, text, flags=re.MULTILINE)


def pages() -> list[Path]:
    """Return the pages that show pictures."""
    return [ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("tutorials/*.md"))]


def main() -> None:
    """Renew all pictures of runs, or those that are named, and the captions of all pages."""
    for name in sys.argv[1:] or PICTURES:
        source = PICTURES[name]
        folder = OUT / Path(source.scene).with_suffix("")
        run(source, folder)
        film, _, fraction = source.file.partition("@")
        if fraction:
            copy_frame(folder / film, float(fraction), DOCS / name)
        else:
            copy(folder / source.file, DOCS / name)
    for page in pages():
        write_text(page, captioned(page.read_text(encoding="utf-8"), page.parent))


if __name__ == "__main__":
    main()
