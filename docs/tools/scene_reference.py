"""`python -m docs.tools.scene_reference`: write docs/scene-reference.md from the models of scene files."""

from pathlib import Path

from gudgeon.pipeline.kinds import scene_tables
from gudgeon.pipeline.scenes.reference.key_reference import markdown

PAGE = Path(__file__).resolve().parents[1] / "scene-reference.md"
HEAD = """# Scene reference

Written by `python -m docs.tools.scene_reference` from the models that check a scene. On the terminal
`gudgeon schema component.interface` prints one table, `gudgeon schema run.step` one key. All numbers are in SI units;
angles with the unit deg are in degrees. *needed*: there is no default; an empty default: off, or as the meaning says.
NAME in the header of a table is yours to choose. A file that begins with `base = "other.toml"` changes the tables of
another file in its folder; the value `"unset"` removes a key.

An editor completes keys and marks mistakes by the JSON schema: `gudgeon schema > scene.schema.json`, and as the first
line of `scene.toml`

```toml
#:schema scene.schema.json
```

"""


def page() -> str:
    """Return the text of the page."""
    return HEAD + markdown(scene_tables())


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
