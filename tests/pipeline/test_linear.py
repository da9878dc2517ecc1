"""`gudgeon linear` on a real scene: a beam held at a tie beside the same beam clamped by supports."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.linear.picture import PANEL, component_names, draw

SCENE = """
[component.free]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.3 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.025 }
interface.root = { surface = "bottom", kind = "tie", tie = "rbe2" }
interface.tip = { surface = "top", kind = "mean" }
modes = { normal_count = 12 }

[component.clamped]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.3 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.025 }
supports = ["bottom"]
interface.tip = { surface = "top", kind = "mean" }
modes = { normal_count = 12 }

[body.free]
[body.clamped]
position = [0.1, 0.0, 0.0]

[motion.base]
kind = "translation"
body = "free"
interface = "root"
direction = [1.0, 0.0, 0.0]
held = true
expression = "0"

[force.one]
kind = "external"
body = "free"
interface = "tip"
direction = [1.0, 0.0, 0.0]

[force.two]
kind = "external"
body = "clamped"
interface = "tip"
direction = [1.0, 0.0, 0.0]

[probe.top]
kind = "velocity"
body = "free"
interface = "tip"

[run]
duration = 0.01
gravity = [0.0, 0.0, -9.81]
"""
Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("beams")
    (found / "scene.toml").write_text(SCENE)
    return found


def command(folder: Path, *options: str) -> list[str]:
    return ["linear", str(folder), "--db", str(folder / "db"), "--out", str(folder / "out"), *options]


def table(path: Path) -> tuple[list[str], np.ndarray]:
    heads, *rows = csv.reader(path.read_text().splitlines())
    return heads, np.array(rows, float)


def test_tie_that_is_held_is_a_clamp(folder: Path, capsys: Capture) -> None:
    """Frequencies of the first bending modes, their shares and effective masses, of both."""
    assert main(command(folder, "--json")) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    modes = {name: [one for one in found["modes"] if one["energy"][name] > 0.99] for name in ("free", "clamped")}
    for one, other in zip(modes["free"][:6], modes["clamped"][:6], strict=True):
        assert one["frequency"] == pytest.approx(other["frequency"], rel=2e-3)
        assert one["damping"] == 0.0
    mass = 7850 * 0.02**2 * 0.3
    for name in modes:  # Bending of a cantilever: 61.3 % and 18.8 % of its mass in each of two planes.
        masses = np.array([one["mass"] for one in modes[name][:4]])
        assert masses[:2, :2].sum(axis=0) == pytest.approx(0.613 * mass, rel=0.01)
        assert masses[2:, :2].sum(axis=0) == pytest.approx(0.188 * mass, rel=0.03)
    heads, rows = table(folder / "out" / "linear-modes.csv")
    assert heads[:3] == ["mode", "frequency [Hz]", "damping ratio [1]"]
    assert rows[:, 1] == pytest.approx([one["frequency"] for one in found["modes"]])
    assert not (folder / "out" / "linear-response.csv").exists()


def test_response_of_both_is_one(folder: Path) -> None:
    answers = []
    for name in ("one", "two"):
        options = ("--force", f"force.{name}", "--loss", "0.02", "--frequencies", "20", "3000", "--points", "300")
        assert main(command(folder, *options, "--quantity", "velocity")) == 0
        heads, rows = table(folder / "out" / "linear-response.csv")
        assert heads == ["frequency [Hz]", f"force.{name} amplitude [m/s/N]", f"force.{name} phase [deg]"]
        answers.append(rows)
        assert (folder / "out" / "linear-response.png").stat().st_size > 10_000
    assert answers[0][:, 0] == pytest.approx(np.geomspace(20, 3000, 300))
    both = [one[:, 1] * np.exp(1j * np.radians(one[:, 2])) for one in answers]
    assert np.abs(both[0] - both[1]).max() < 0.02 * np.abs(both[1]).max()
    w = 2 * np.pi * answers[0][0, 0]
    static = 0.3**3 / (3 * 210e9 * 0.02**4 / 12)
    assert answers[0][0, 1] == pytest.approx(static * w, rel=0.03)


@pytest.mark.parametrize("axis", ["[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]"])
def test_a_base_moves_along_its_direction(axis: str, folder: Path, capsys: Capture) -> None:
    """Slowly, the body follows it, whatever the rows of the tie are called."""
    along = ("--set", f"motion.base.direction={axis}", "--set", f"force.one.direction={axis}")
    ends = ("--force", "motion.base", "--at", "force.one", "--frequencies", "1", "2", "--points", "2")
    assert main(command(folder, *along, *ends)) == 0
    assert table(folder / "out" / "linear-response.csv")[1][0, 1] == pytest.approx(1.0, rel=1e-3)


WRONG = {
    "--force force.on": "--force 'force.on': there is none in the scene, did you mean 'force.one'? it has",
    "--force force.one --at probe.tip": "--at 'probe.tip': there is none in the scene",
    "--force force.one --at probe.top": "--at 'probe.top': a probe of velocity is not read here; allowed: probes of",
    "--at force.one": "--at: a response needs --force",
    "--force force.one --frequencies 100 10": "--frequencies 100 10: two rising frequencies above zero",
    "--force force.one --points 1 --frequencies 1 2": "--points 1: allowed: 2 to",
    "--force force.one --quantity speed": "--quantity 'speed': allowed: displacement, velocity, acceleration",
    "--force force.one --loss 1.5": "--loss 1.5: allowed: 0 to below 1",
    "--closed contact.floor": "--closed 'contact.floor': there is none in the scene, it has none",
}


@pytest.mark.parametrize("options", WRONG)
def test_wrong_options_have_one_line(options: str, folder: Path, capsys: Capture) -> None:
    assert main(command(folder, *options.split())) == 2
    line = [one for one in capsys.readouterr().err.splitlines() if "…" not in one]
    assert len(line) == 1
    assert line[0].startswith(f"gudgeon: {WRONG[options]}")


NARROW = """
[component.p]
geometry = { kind = "rigid", mass = 1.0, inertia = [0.01, 0.01, 0.01] }
[body.p]
freedom = ["z"]
[force.s]
kind = "spring"
body = "p"
direction = [0, 0, 1]
stiffness = 394784.176
damping = DAMPING
[force.e]
kind = "external"
body = "p"
direction = [0, 0, 1]
[run]
duration = 0.05
step = 1e-5
"""
"""A mass of 1 kg that vibrates at 100 Hz."""


@pytest.mark.parametrize("ratio", [1e-5, 1e-3, 0.2])
def test_a_response_meets_the_peak_of_a_narrow_resonance(ratio: float, tmp_path: Path, capsys: Capture) -> None:
    """1/(k 2 ζ √(1 − ζ²)), whether the range is that around the modes or one that is given."""
    (tmp_path / "scene.toml").write_text(NARROW.replace("DAMPING", f"{2 * ratio * np.sqrt(394784.176):.17g}"))
    for limits in ((), ("--frequencies", "3", "4000")):
        assert main(command(tmp_path, "--force", "force.e", *limits)) == 0
        _, rows = table(tmp_path / "out" / "linear-response.csv")
        assert rows[:, 1].max() == pytest.approx(1 / (394784.176 * 2 * ratio * np.sqrt(1 - ratio**2)), rel=1e-3)
        assert "--points" not in capsys.readouterr().err


def test_a_response_whose_points_are_given_says_what_they_step_over(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "scene.toml").write_text(NARROW.replace("DAMPING", "0.0125663706"))
    assert main(command(tmp_path, "--force", "force.e", "--points", "50")) == 0
    assert "--points: 1 resonances are narrower than the spacing, that at 100 Hz is 0.002 Hz" in capsys.readouterr().err
    assert len(table(tmp_path / "out" / "linear-response.csv")[1]) == 50
    (tmp_path / "scene.toml").write_text(NARROW.replace("DAMPING", "0.0"))
    assert main(command(tmp_path, "--force", "force.e")) == 0
    assert "the response has no bound at 1 undamped modes, the lowest at 100 Hz" in capsys.readouterr().err


def test_curves_have_the_names_of_components_and_a_panel_for_each_unit(tmp_path: Path) -> None:
    stresses = [f"gauge.b.fillet[{k}]" for k in range(1, 7)]
    labels = ["probe.tip", *stresses, "joint.pin[1]", "joint.pin[2]"]
    names = ["probe.tip", *(f"gauge.b.fillet {axes}" for axes in ("xx", "yy", "zz", "xy", "yz", "zx")), *labels[-2:]]
    assert component_names(labels) == names
    frequencies = np.geomspace(10.0, 1e3, 50)
    answers = 1.0 / (1.0 + 1j * frequencies[:, None] / 100.0) * np.r_[1e-6, np.full(6, 1e6), 1e-6, 1e-6]
    units = ["m/N", *["Pa/N"] * 6, "m/N", "m/N"]
    heights = []
    for count in (1, 9):
        draw(tmp_path / "response.png", ("scene", "title"), frequencies, answers[:, :count],
             (labels[:count], units[:count]), 500.0)  # fmt: skip
        heights.append(Image.open(tmp_path / "response.png").height)
    assert heights[1] - heights[0] == PANEL
