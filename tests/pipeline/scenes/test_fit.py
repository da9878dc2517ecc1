"""A driven pair that cannot work is refused when its scene is read: what is wrong, where, and what may be instead."""

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.scenes.reading import read_tables

ROOT = Path(__file__).resolve().parents[3]
PISTON = ROOT / "data/piston"
PROFILE = "component.piston.change.profile"
LINEAR = 0.05
"""[µm]: linear interpolation of the profile over 2 mm and 15°, and the grid of the search."""
WORST = re.compile(
    r"contact\.(\w+): the clearance is below zero on (under 1|\d+)% of '(\w+)', worst (-\S+) µm at height (\S+) m and"
    r" (-?\d+) degrees, all along the stroke; the bore's radius is (\S+) m, the radius there (\S+?) m(;.*)?"
)


@pytest.fixture(autouse=True)
def _nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Work in an empty folder, and leave it empty: neither `.gudgeon` nor `out` may come to be."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    before = sorted(PISTON.iterdir())
    yield
    assert list(here.iterdir()) == []
    assert sorted(PISTON.iterdir()) == before


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the piston's folder, to spoil."""
    shutil.copytree(PISTON, tmp_path / "piston")
    return tmp_path / "piston"


def refused(scene: Path, *settings: str, where: Path | None = None) -> list[str]:
    """Return the complaints about a scene, without the file that each must begin with."""
    with pytest.raises(InputError) as caught:
        open_job(scene, set=settings)
    place = f"{where or (scene / 'scene.toml' if scene.is_dir() else scene)}: "
    lines = str(caught.value).splitlines()
    assert [line for line in lines if not line.startswith(place)] == []
    return [line.removeprefix(place) for line in lines]


@pytest.mark.parametrize(
    "settings",
    [
        (),
        ("component.liner.geometry.bore_radius=0.04297",),
        (f"{PROFILE}.offset=3.99e-5",),
        ("body.piston.position=[3.9e-5, 0.0, 0.0]",),
        ("joint.rod.centre=[0.0, 0.0, -0.0591]",),
        ("component.liner.geometry.length=0.1211",),
    ],
)
def test_what_just_fits_is_taken(settings: tuple[str, ...]) -> None:
    """The refusals below are not for anything else."""
    assert open_job(PISTON, set=settings).scene.joint["rod"].rod_length == 0.14


# The clearance


@pytest.mark.parametrize(
    ("settings", "worst", "height", "angles"),
    [
        # At the top end and 45° the table is 25 + 30 µm below the nominal radius, which has 40 µm of clearance.
        ((f"{PROFILE}.scale=-1",), 40 - 25 - 30, 0.034, {"thrust": {-45, 45}, "anti": {135, 225}}),
        ((f"{PROFILE}.offset=5e-5",), 40 - 50, 0.014, {"thrust": {0}, "anti": {180}}),
        (("component.liner.geometry.bore_radius=0.04295",), -10, 0.014, {"thrust": {0}, "anti": {180}}),
        (("component.piston.geometry.outer_radius=0.043012",), -12, 0.014, {"thrust": {0}, "anti": {180}}),
        (("body.piston.position=[6e-5, 0.0, 0.0]",), 40 - 60, 0.014, {"thrust": {0}}),
        (("body.liner.position=[6e-5, 0.0, 0.0]",), 40 - 60, 0.014, {"anti": {180}}),
        # At 45° the oval takes away 30 µm, and of 110 µm aside 78 count.
        (("body.piston.position=[0.0, 1.1e-4, 0.0]",), 40 + 30 - 77.78, 0.014, {"thrust": {45}, "anti": {135}}),
    ],
)
def test_clearance_below_zero(
    settings: tuple[str, ...], worst: float, height: float, angles: dict[str, set[int]]
) -> None:
    lines = refused(PISTON, *settings)
    assert len(lines) == len(angles)
    for line, (contact, allowed) in zip(lines, angles.items(), strict=True):
        found = WORST.fullmatch(line)
        assert found, line
        assert found[1] == found[3] == contact
        assert float(found[4]) == pytest.approx(worst, abs=LINEAR)
        assert float(found[5]) == pytest.approx(height, abs=2e-4)
        assert int(found[6]) in allowed
        assert found[2] == "under 1" or 0 < int(found[2]) < 100
        aside = float(re.findall(r"[\d.]+", found[9])[0]) if found[9] else 0.0
        assert bool(aside) == ("position" in settings[0])
        clearance = 1e6 * (float(found[7]) - float(found[8])) - aside
        assert clearance == pytest.approx(worst, abs=0.3)  # radii are printed to seven digits


def test_share_of_the_skirt_that_is_too_large() -> None:
    for bore, share in ((0.042904, "100"), (0.0429598, "under 1")):
        found = WORST.fullmatch(refused(PISTON, f"component.liner.geometry.bore_radius={bore}")[0])
        assert found
        assert found[2] == share


def test_profile_of_another_surface_does_not_count() -> None:
    """The belt's profile leaves the skirt as it is."""
    settings = ("component.piston.geometry.outer_radius=0.04301", f"{PROFILE}.surface=belt")
    found = WORST.fullmatch(refused(PISTON, *settings)[0])
    assert found
    assert (found[2], float(found[4])) == ("100", -10)
    assert open_job(PISTON, set=(f"{PROFILE}.surface=belt", f"{PROFILE}.offset=5e-5"))


# The mechanism


@pytest.mark.parametrize(
    ("settings", "given", "needed"),
    [
        (("joint.rod.rod_length=0.0432",), "0.0432", "0.0435"),
        (("joint.rod.rod_length=0.0435",), "0.0435", "0.0435"),
        (("joint.rod.rod_length=0.047", "component.piston.geometry.pin_offset=-0.005"), "0.047", "0.048"),
        (("joint.rod.centre=[0.1, 0.0, -0.078]",), "0.14", "0.1425"),
        (("joint.rod.rod_length=0.0436", "body.piston.position=[1e-5, 0.0, 0.0]", "joint.rod.crank_radius=0.0432"),
         "0.0436", "0.04371"),
    ],
)  # fmt: skip
def test_rod_that_does_not_reach(settings: tuple[str, ...], given: str, needed: str) -> None:
    assert refused(PISTON, *settings)[0] == (
        f"joint.rod.rod_length: {given} m given; it must be above crank_radius plus the pin's offset from the crank"
        f" axis, {needed} m"
    )


@pytest.mark.parametrize("length", [0.043, 0.02])
def test_rod_shorter_than_the_crank(length: float) -> None:
    assert refused(PISTON, f"joint.rod.rod_length={length}") == [
        f"joint.rod: rod_length is {length} m, it must be above crank_radius = 0.043 m plus the offset of the pin"
    ]


@pytest.mark.parametrize(
    ("setting", "low", "high", "span", "missing"),
    [
        # Crank and rod in line put the skirt's lower end at centre + 0.183 − 0.018 m, and 0.086 m below.
        ("component.liner.geometry.length=0.12", 0.001, 0.121, (0, 0.12), 1.0),
        ("joint.rod.centre=[0.0, 0.0, -0.083]", -0.004, 0.116, (0, 0.14), 4.0),
        ("joint.rod.centre=[0.0, 0.0, -0.058]", 0.021, 0.141, (0, 0.14), 1.0),
        ("joint.rod.crank_radius=0.05", -0.006, 0.128, (0, 0.14), 6.0),
        ("body.liner.position=[0.0, 0.0, 0.01]", -0.009, 0.111, (0, 0.14), 9.0),
        ("component.liner.interface.thrust.height=[0.02, 0.13]", 0.001, 0.121, (0.02, 0.13), 19.0),
    ],
)
def test_liner_that_is_too_short(
    setting: str, low: float, high: float, span: tuple[float, float], missing: float
) -> None:
    lines = refused(PISTON, setting)
    assert len(lines) == (1 if "interface" in setting else 2)
    for line, name in zip(lines, ("thrust", "anti"), strict=False):
        found = re.fullmatch(
            rf"contact\.{name}: '{name}' travels from (\S+) to (\S+) m along '{name}', which reaches from"
            rf" {span[0]} to {span[1]} m: (\S+) mm too short; move joint\.rod\.centre, or give a longer"
            r" component\.liner\.geometry",
            line,
        )
        assert found, line
        # The pin's offset shortens rod and crank in line by less than 2 µm.
        assert [float(text) for text in found.groups()[:2]] == pytest.approx([low, high], abs=3e-6)
        assert float(found[3]) == pytest.approx(missing, abs=3e-3)


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ("joint.rod.along=[1.0, 0.0, 1.0]", "joint.rod: along and lateral must be at right angles"),
        ("joint.rod.along=[0, 0, 0]", "joint.rod.along: the vector is zero, it must have a direction"),
        ("joint.rod.speed=0", "joint.rod.speed: 0 given; input should be greater than 0"),
        ("joint.rod.crank_radius=nan", "joint.rod.crank_radius: nan given; input should be "),
        ("joint.rod.kind=crank", "joint.rod.kind: 'crank' given; input should be one of 'slider-crank', 'fixed', "),
        ("force.gas.kind=sail", "force.gas.kind: 'sail' given"),
        ("force.gas.ambient=inf", "force.gas.ambient: inf given; input should be a finite number"),
        ("body.piston.damping.ratio=1", "body.piston.damping.ratio: 1 given; input should be less than 1"),
        ("body.piston.freedom=['x', 'w']", "body.piston.freedom.1: 'w' given; input should be 'x', 'y', 'z', 'rx'"),
        ("report.until=0", "report.until: 0 given; input should be greater than 0"),
        (
            "run.integrator=event",
            "run.integrator: 'event' does not support damping of body.piston, damping of body.liner, joint.rod and 3"
            " more elements; use 'auto' or 'small'",
        ),
        (
            "run.integrator=explicit",
            "run.integrator: 'explicit' given, a former integrator; use 'small'",
        ),
    ],
)
def test_value_that_is_not_allowed(setting: str, complaint: str) -> None:
    (line,) = refused(PISTON, setting)
    assert line.startswith(complaint)


ROWS = "three numbers [x, y, z] in N/m or three rows of three numbers [x, y, z] in N/m"


@pytest.mark.parametrize(
    ("stiffness", "complaint"),
    [
        ("[1, 2, 3, 4, 5, 6]", f": [1, 2, 3, 4, 5, 6] given; allowed: {ROWS}"),
        ("[1, 2]", f": [1, 2] given; allowed: {ROWS}"),
        ("soft", f": 'soft' given; allowed: {ROWS}"),
        ("[[1, 0, 0], [0, 1], [0, 0, 1]]", f": [[1, 0, 0], [0, 1], [0, 0, 1]] given; allowed: {ROWS}"),
        ("[inf, 0, 0]", ".0: inf given; input should be a finite number"),
    ],
)
def test_a_value_of_several_forms_is_refused_in_one_line(stiffness: str, complaint: str) -> None:
    bushing = '{kind="bushing", body="piston", interface="pin"}'
    (line,) = refused(PISTON, f"force.soft={bushing}", f"force.soft.stiffness={stiffness}")
    assert line.startswith(f"force.soft.stiffness{complaint}")


# Names

PARTS = "thrust, anti, pin, crown"


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        (
            "contact.thrust.body=pistn",
            "contact.thrust.body: no body 'pistn', did you mean 'piston'? the scene has piston, liner",
        ),
        (
            "contact.anti.against.body=liners",
            "contact.anti.against.body: no body 'liners', did you mean 'liner'? the scene has piston, liner",
        ),
        ("joint.rod.body=rod", "joint.rod.body: no body 'rod', the scene has piston, liner"),
        ("force.gas.body=gas", "force.gas.body: no body 'gas', the scene has piston, liner"),
        ("force.gas.joint=crank", "force.gas.joint: no joint 'crank', the scene has rod"),
        ("body.liner.component=tube", "body.liner.component: no component 'tube'; the scene has piston, liner"),
        (
            "contact.thrust.interface=trust",
            f"contact.thrust.interface: no interface 'trust', did you mean 'thrust'? the component has {PARTS}",
        ),
        (
            "contact.anti.against.interface=ant",
            "contact.anti.against.interface: no interface 'ant', did you mean 'anti'? the component has thrust, anti",
        ),
        ("joint.rod.interface=bolt", f"joint.rod.interface: no interface 'bolt', the component has {PARTS}"),
        ("force.gas.interface=top", f"force.gas.interface: no interface 'top', the component has {PARTS}"),
        (
            "contact.thrust.interface=pin",
            "contact.thrust.interface: interface 'pin' is of kind 'mean', kind 'points' or 'patch' is needed",
        ),
        (
            "contact.thrust.against.body=piston",
            "contact.thrust.against.interface: 'thrust' of 'piston' on both sides; a body meets itself by two"
            " interfaces",
        ),
        (
            "joint.rod.interface=crown",
            "joint.rod.interface: interface 'crown' is of kind 'pressure', kind 'mean' is needed",
        ),
        (
            "force.gas.interface=pin",
            "force.gas.interface: interface 'pin' is of kind 'mean', kind 'pressure' is needed",
        ),
    ],
)
def test_name_that_is_wrong(setting: str, complaint: str) -> None:
    assert refused(PISTON, setting) == [complaint]


def test_wrong_names_are_listed_at_once() -> None:
    settings = ("joint.rod.interface=crown", "force.gas.interface=pin", "contact.anti.interface=ant")
    assert [line.partition(": ")[0] for line in refused(PISTON, *settings)] == [
        "contact.anti.interface",
        "joint.rod.interface",
        "force.gas.interface",
    ]


# The tables

GAS = (PISTON / "gas-pressure.csv").read_text()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            "\n".join(GAS.splitlines()[:702]),
            "angles reach from 0 to 700 degrees, 700 in all; a cycle must close over 720 (or 360)",
        ),
        (
            GAS.replace("720,5422140.7", "720,5000000.0"),
            "the first value is 5.42214e+06 and the last 5e+06 at the same",
        ),
        (GAS.replace("\n300,", "\n30,"), "row 302: the angle 30 must be above that of the row before"),
        (GAS.replace("\n300,", "\n300,high"), "row 302 holds 'high"),
        (GAS.replace("\n1,", "\n1,nan #"), "row 3 holds 'nan #"),
        (GAS.replace("1,5696264.1", "1,nan"), "row 3 holds 'nan', a finite number is needed"),
    ],
)
def test_pressure_table_that_is_refused(text: str, complaint: str, copy: Path) -> None:
    assert text != GAS
    table = copy / "gas-pressure.csv"
    table.write_text(text)
    (line,) = refused(copy, where=table)
    assert line.startswith(complaint)


def test_pressure_table_that_is_missing() -> None:
    assert refused(PISTON, "force.gas.table=none.csv") == [
        f"force.gas.table: no file 'none.csv', neither in {PISTON} nor in the current folder"
    ]


def test_table_of_the_other_kind() -> None:
    """A profile is no pressure, and a pressure no profile."""
    (line,) = refused(PISTON, "force.gas.table=skirt-profile.csv", where=PISTON / "skirt-profile.csv")
    assert line == "row 2 has 26 cells, angle [deg] and value are needed"
    (line,) = refused(PISTON, f"{PROFILE}.table=gas-pressure.csv", where=PISTON / "gas-pressure.csv")
    assert line == "row 1 holds 'absolute pressure_Pa', a number is needed"


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ("[[0.0, 2e5], [20.0, 1e5], [10.0, 1e5]]", "row 3: the angle 10 must be above that of the row before"),
        ("[[0.0, 2e5], [20.0, 1e5], [700.0, 2e5]]", "angles reach from 0 to 700 degrees"),
        ("[[0.0, 2e5], [20.0, 1e5], [720.0, 1e5]]", "the first value is 200000 and the last 100000"),
    ],
)
def test_pressures_in_the_scene_itself(values: str, complaint: str, copy: Path) -> None:
    toml = copy / "scene.toml"
    toml.write_text(toml.read_text().replace('table = "gas-pressure.csv"', f"values = {values}"))
    (line,) = refused(copy)
    assert line.startswith(f"force.gas.values: {complaint}")


def test_pressures_are_in_the_solvers_scene() -> None:
    """The trajectory's key must know them."""
    values = open_job(PISTON).dynamics()["force"]["gas"]["values"]
    assert len(values) == 721
    assert values[1] == [1.0, 5696264.1]


# The command


@pytest.mark.parametrize(
    ("setting", "line"),
    [
        (
            "body.piston.position=[6e-5, 0.0, 0.0]",
            "contact.thrust: the clearance is below zero on 45% of 'thrust', worst -20 µm",
        ),
        ("joint.rod.rod_length=0.0432", "joint.rod.rod_length: 0.0432 m given; it must be above"),
        ("force.gas.table=none.csv", "force.gas.table: no file 'none.csv'"),
        ("force.gas.interface=pin", "force.gas.interface: interface 'pin' is of kind 'mean', kind 'pressure'"),
        (
            "run.integrator=event",
            "run.integrator: 'event' does not support damping of body.piston, damping of body.liner, joint.rod and 3"
            " more elements; use 'auto'",
        ),
    ],
)
@pytest.mark.parametrize("command", ["plan", "run", "report"])
def test_command_that_is_refused(command: str, setting: str, line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(PISTON), "--set", setting]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    (complaint,) = output.err.splitlines()
    assert complaint.startswith(f"gudgeon: {PISTON / 'scene.toml'}: {line}")


def test_process_that_is_refused() -> None:
    arguments = ["plan", "data/piston", "--set", "joint.rod.rod_length=0.0432"]
    child = subprocess.run(
        [sys.executable, "-m", "gudgeon.pipeline", *arguments], cwd=ROOT, capture_output=True, text=True
    )
    assert (child.returncode, child.stdout) == (2, "")
    assert child.stderr == (
        "gudgeon: data/piston/scene.toml: joint.rod.rod_length: 0.0432 m given; it must be above crank_radius plus the"
        " pin's offset from the crank axis, 0.0435 m\n"
    )


# Scenes with a base


def test_coarse_scene_is_the_base_with_changes() -> None:
    base, coarse = read_tables(PISTON / "scene.toml"), read_tables(PISTON / "coarse.toml")
    changes = tomllib.loads((PISTON / "coarse.toml").read_text())
    assert "base" not in coarse
    assert {key: coarse[key] for key in base if key not in changes} == {
        key: base[key] for key in base if key not in changes
    }
    parts = base["component"]
    parts["piston"]["mesh"]["size"] = 0.012
    parts["piston"]["change"]["update"] = "recompute"
    parts["liner"]["mesh"]["size"] = 0.016
    for side in ("thrust", "anti"):
        parts["liner"]["interface"][side]["spacing"] = 0.010
    assert coarse["component"] == parts
    assert coarse["report"] == base["report"] | changes["report"]
    assert coarse["report"]["until"] == 0.012


def test_settings_stand_above_the_file_and_the_file_above_its_bases(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("run = { duration = 1, samples = 1, frames = 1, step = 1 }\n")
    (tmp_path / "b.toml").write_text('base = "a.toml"\nrun = { samples = 2, frames = 2, step = 2 }\n')
    (tmp_path / "c.toml").write_text('base = "b.toml"\nrun = { frames = 3, step = 3 }\n')
    tables = read_tables(tmp_path / "c.toml", ["run.step=4"])
    assert tables == {"run": {"duration": 1, "samples": 2, "frames": 3, "step": 4}}


def test_mistake_in_a_scene_with_a_base_names_the_scene() -> None:
    (line,) = refused(PISTON / "coarse.toml", "joint.rod.rod_length=0.0432")
    assert line.startswith("joint.rod.rod_length: 0.0432 m given")


@pytest.mark.parametrize(
    ("base", "complaint"),
    [
        ('"none.toml"', "base: no file 'none.toml' next to it"),
        ('""', "base: no file '' next to it"),
        ('"."', "base: no file '.' next to it"),
        ("3", "base: no file 3 next to it"),
        ('["scene.toml"]', "base: no file ['scene.toml'] next to it"),
        ('"own.toml"', "base: 'own.toml' is based on this file itself"),
        ('"../piston/own.toml"', "base: '../piston/own.toml' is based on this file itself"),
    ],
)
def test_base_that_is_none(base: str, complaint: str, copy: Path) -> None:
    own = copy / "own.toml"
    own.write_text(f"base = {base}\n")
    assert refused(own) == [complaint]


def test_bases_that_go_round(copy: Path) -> None:
    (copy / "a.toml").write_text('base = "b.toml"\n')
    (copy / "b.toml").write_text('base = "../piston/a.toml"\n')
    assert refused(copy / "a.toml", where=copy / "b.toml") == ["base: '../piston/a.toml' is based on this file itself"]


@pytest.mark.parametrize(
    ("content", "complaint"),
    [(b"# H\xf6he", "cannot be read (not UTF-8 text)"), (b"[run\n", "not valid TOML: ")],
)
def test_base_that_cannot_be_read(content: bytes, complaint: str, copy: Path) -> None:
    (copy / "other.toml").write_bytes(content)
    (copy / "own.toml").write_text('base = "other.toml"\n')
    (line,) = refused(copy / "own.toml", where=copy / "other.toml")
    assert line.startswith(complaint)
