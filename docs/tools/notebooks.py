"""`python -m docs.tools.notebooks`: write docs/notebooks/*.ipynb, without outputs, and the list of them.

A notebook here is a title and cells: text, or code that begins with `#:`. `tests/test_docs.py` runs the code.
"""

import json
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
CODE = "#:\n"
NOTEBOOKS: dict[str, tuple[str, ...]] = {
    "1-first-run": (
        "# A first run\n\nTwo steel spheres meet. `run` returns quantities, each with value, unit and reference.",
        '#:\nimport gudgeon\n\nfound = gudgeon.run("data/hertz", until="solve")\nfound.to_frame()',
        "The force over time, and what the run says of its own error.",
        "#:\nfigure = found.plot()\nfigure",
        "#:\nfound.energy_drift, found.estimates",
    ),
    "2-your-own-part": (
        "# A part of your own\n\nA scene: geometry, material, a place that touches, a body, a contact, a run.",
        '#:\nfrom pathlib import Path\n\nimport gudgeon\n\nscene = """\n'
        'component.part.geometry = { kind = "box", lx = 0.06, ly = 0.04, lz = 0.02 }\n'
        "component.part.mesh.size = 0.01\n"
        "component.part.material = { E = 210e9, nu = 0.3, rho = 7850 }\n"
        'component.part.interface.foot.surface = "bottom"\n'
        "body.part = { position = [0, 0, 1e-4], velocity = [0, 0, -0.5] }\n"
        'contact.floor = { body = "part", interface = "foot", surface_stiffness = 1e12,'
        ' against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] } }\n'
        'run.duration = 5e-4\n"""\n'
        'Path("part.toml").write_text(scene)\nfound = gudgeon.run("part.toml", until="solve")\n'
        'found.quantities["floor.impulse"]',
        "The impulse is the change of momentum, mass × (approach + rebound speed).",
        '#:\nmass = 7850 * 0.06 * 0.04 * 0.02\nrebound = found.quantities["part.velocity_z"]["value"]\n'
        'assert abs(mass * (0.5 + rebound) / found.quantities["floor.impulse"]["value"] - 1) < 1e-3',
    ),
    "3-modes": (
        "# Modes as arrays\n\nA component's records are read by its name.",
        '#:\nimport gudgeon\n\ngudgeon.run("data/rod-wall", until="morph")\n'
        'modes = gudgeon.open_job("data/rod-wall").record("rod", "modes")\nmodes.frequencies[:5]',
        "A free rod of length L has the frequencies n c / (2 L), equally spaced.",
        "#:\nspacing = modes.frequencies[1:6] / modes.frequencies[:5]\nspacing",
        '#:\nmodes.to_xarray()["shapes"].dims',
    ),
    "4-trajectory": (
        "# Histories with names and units",
        '#:\nimport gudgeon\n\nfound = gudgeon.run("data/two-mass", until="solve")\n'
        "data = found.trajectory().to_xarray()\ndata",
        "Energies over time: kinetic, strain, contact, dissipated, work of loads.",
        '#:\ndata["energies"].sel({"energies.column": "kinetic"})[-1]',
    ),
    "5-set": (
        "# Change a key\n\n`set` changes any key; what it does not touch is taken from the database.",
        '#:\nimport gudgeon\n\nslow = gudgeon.run("data/hertz", set={"body.one.velocity": [0.5, 0.0, 0.0]},'
        ' until="solve", out="slow")\nfast = gudgeon.run("data/hertz", until="solve", out="fast")\n'
        'ratio = fast.quantities["pair.force_peak_raw"]["value"] / slow.quantities["pair.force_peak_raw"]["value"]\n'
        "ratio, 2 ** (6 / 5)",
        "Hertz: the force grows with the speed to the power 6/5.",
        "#:\nassert abs(ratio / 2 ** (6 / 5) - 1) < 1e-3",
    ),
    "6-study": (
        "# A table of designs",
        '#:\nimport gudgeon\n\ntable = gudgeon.study("data/two-mass", vary=["body.striker.velocity.0=0.5:2:4"])\ntable',
        "All columns, as those of `study.csv`:",
        '#:\nframe = table.to_frame()\nframe[["body.striker.velocity.0", "pair.impulse [N s]"]]',
    ),
    "7-step-by-step": (
        "# Step by step\n\nThe caller steps a scene and sets a force between steps: here a hand that holds a ball.",
        '#:\nimport gudgeon\n\nsim = gudgeon.simulation("data/held-ball")\nwhile sim.time < 0.5:\n'
        '    ball = sim.body("ball")\n'
        '    sim.force("hand")[:] = 40.0 * (0.5 - ball.displacement[2]) - 6.0 * ball.velocity[2]\n'
        '    sim.step()\nsim.time, sim.body("ball").displacement[2]',
    ),
    "8-mistakes": (
        "# Mistakes are one line\n\nThe exception has the line of the terminal: file, key, value, what is allowed.",
        "#:\nimport gudgeon\nfrom gudgeon.pipeline.errors import InputError\n\ntry:\n"
        '    gudgeon.run("data/hertz", set={"run.duraton": 1e-3})\nexcept InputError as error:\n    print(error)',
        "Keys are explained by `gudgeon schema`, in Python by `gudgeon.pipeline.kinds.scene_tables()`.",
        "#:\nfrom gudgeon.pipeline.kinds import scene_tables\n"
        "from gudgeon.pipeline.scenes.reference.key_reference import key_text\n\n"
        'print(key_text(scene_tables(), "run.duration"))',
    ),
}


def cells(name: str) -> list[tuple[str, str]]:
    """Return kind, `markdown` or `code`, and text of each cell of a notebook."""
    return [("code", text.removeprefix(CODE)) if text.startswith(CODE) else ("markdown", text)
            for text in NOTEBOOKS[name]]  # fmt: skip


def notebook(name: str) -> str:
    """Return the text of a notebook's file."""
    found = []
    for number, (kind, text) in enumerate(cells(name)):
        cell = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": text.splitlines(keepends=True)}
        found.append(cell | ({"execution_count": None, "outputs": []} if kind == "code" else {}))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    document = {"cells": found, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def listing() -> str:
    """Return the list of the notebooks."""
    head = (
        "# Notebooks\n\nWritten by `python -m docs.tools.notebooks`; each runs in the folder of the repository in less"
    )
    lines = [f"- [{cells(name)[0][1].splitlines()[0].lstrip('# ')}]({name}.ipynb)" for name in NOTEBOOKS]
    return f"{head}\nthan a minute, with `pip install 'gudgeon[all,frames]'` and any notebook program.\n\n" + (
        "\n".join(lines) + "\n"
    )


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for one in NOTEBOOKS:
        (FOLDER / f"{one}.ipynb").write_text(notebook(one), encoding="utf-8")
    (FOLDER / "README.md").write_text(listing(), encoding="utf-8")
