"""`python -m docs.tools.gallery`: write docs/gallery.md, the scenes of data/ with sentence, command and picture."""

import tomllib
from pathlib import Path

from docs.tools.pictures import captioned

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "gallery.md"
PICTURES = {
    "piston": "deformation.png", "bladed-disk": "wheel.png", "base-sensor": "base-sensor.png",
    "beam-sphere": "impacts.png", "mems-assembly": "mems-assembly.png", "skirt": "stress.png",
    "clearance-joint": "wear-pin.png",
}  # fmt: skip
"""Pictures of other pages that show a scene of a folder; those of other folders are `docs/gallery/FOLDER.png`."""
HEAD = """# Gallery of scenes

Written by `python -m docs.tools.gallery` from the scenes' first sentences. `gudgeon example copy NAME` copies a folder.
Scenes that only prove something are in [tests/validation/scenes](../tests/validation/scenes); the
[reports](reports/README.md) list them all.

"""


def sentence(text: str) -> str:
    """Return the first sentence of the comment at the top of a scene."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines).partition(". ")[0].rstrip(".").replace("|", r"\|")


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for folder in sorted({path.parent for path in ROOT.glob("data/*/*.toml")}):
        scenes = sorted(folder.glob("*.toml"), key=lambda path: (path.name != "scene.toml", path.name))
        scenes = [path for path in scenes if set(tomllib.loads(path.read_text(encoding="utf-8"))) != {"case"}]
        parts.append(f"## {folder.name}\n\n")
        picture = PICTURES.get(folder.name, f"gallery/{folder.name}.png")
        parts.append(f"![{folder.name}]({picture})\n\n")
        parts.append("| scene | command |\n|---|---|\n")
        for path in scenes:
            name = path.relative_to(ROOT).as_posix()
            command = f"gudgeon run {name.removesuffix('/scene.toml')}"
            parts.append(f"| [{sentence(path.read_text(encoding='utf-8')) or path.stem}](../{name}) | `{command}` |\n")
        parts.append("\n")
    return captioned("".join(parts).rstrip("\n") + "\n", PAGE.parent)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
