"""`python -m docs.tools.commands`: write docs/commands.md from the command line's own help."""

import argparse
from pathlib import Path

from gudgeon.pipeline.cli.help.examples import EXAMPLES
from gudgeon.pipeline.cli.help.usage import GROUPS
from gudgeon.pipeline.cli.parser import build_parser

PAGE = Path(__file__).resolve().parents[1] / "commands.md"
DATABASE = {"db": "gudgeon db ls --kind modes", "serve": "gudgeon serve"}
"""Examples of commands whose own ones are elsewhere."""
HEAD = """# Commands

Written by `python -m docs.tools.commands`; `gudgeon COMMAND --help` has all options. A SCENE is a folder with
`scene.toml`, or a TOML file. `--set KEY=VALUE` changes a key for one run, `--db` names the database, `--out` the
folder of results. Exit code: 0 success, 1 the run failed, 2 the input is wrong.
"""


def page() -> str:
    """Return the text of the page: one table a group."""
    (commands,) = (a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction))
    helps = {action.dest: (action.help or "").replace("|", "/") for action in commands._get_subactions()}
    texts = [HEAD]
    for title, names in GROUPS.items():
        examples = {name: DATABASE.get(name) or EXAMPLES[name][0][0] for name in names}
        rows = [f"| `{name}` | {helps[name]} | `{examples[name]}` |\n" for name in names]
        texts.append(f"## {title.capitalize()}\n\n| command | what it does | example |\n|---|---|---|\n{''.join(rows)}")
    return "\n".join(texts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
