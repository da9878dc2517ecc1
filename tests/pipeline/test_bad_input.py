"""Wrong input, damaged records, places that cannot be written, Ctrl-C: one line each, and nothing half-written."""

import re
import shutil
import signal
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import meshio
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.plots import PLOTS
from tests.modaldb.samples import verify_record
from tests.pipeline.small import TABLE, write_scene

ROOT = Path(__file__).resolve().parents[2]
SCALE = "component.skirt.change.profile.scale"
MOVED = "component.skirt.change.profile.surface"
THRUST = "component.skirt.interface.thrust"
SLIDE = "component.skirt.interface.slide"
SUPPORTS = "component.skirt.supports"
MODES = "component.skirt.modes"
SKIRT = "component.skirt"
GEOMETRY = re.compile(r"^geometry = .*$", re.MULTILINE)
KEPT = "finished stages are in the database: run the same command again to continue"
PATIENCE = 60.0
"""Seconds after which a child that does not end counts as hung."""


def slide(**given: object) -> str:
    """Return a traction interface as TOML."""
    table: dict[str, object] = {"surface": "inner", "kind": "traction", "spacing": 0.01, "sector_deg": [-60.0, 60.0]}
    return "{" + ", ".join(f"{key} = {value!r}" for key, value in (table | given).items()) + "}"


@dataclass(frozen=True)
class Case:
    """A scene with its database and results, for one test to spoil."""

    folder: Path

    @property
    def scene(self) -> Path:
        return self.folder / "scene"

    @property
    def toml(self) -> Path:
        return self.scene / "scene.toml"

    @property
    def db(self) -> Path:
        return self.folder / "db"

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def command(self, name: str, *sets: str) -> list[str]:
        """Return the arguments of a command on this scene."""
        settings = [text for item in sets for text in ("--set", item)]
        return [name, str(self.scene), "--db", str(self.db), "--out", str(self.out), *settings]

    def edit(self, old: str | re.Pattern[str], new: str) -> None:
        """Change the scene's text."""
        text = self.toml.read_text()
        changed = old.sub(new, text) if isinstance(old, re.Pattern) else text.replace(old, new)
        assert changed != text
        self.toml.write_text(changed)

    def table(self, text: str) -> str:
        """Write a profile table and return the setting that asks for it."""
        (self.scene / "table.csv").write_text(text)
        return f"{TABLE}=table.csv"

    def keys(self) -> set[str]:
        """Return the keys of the database."""
        return set(modaldb.open(self.db).keys()) if self.db.is_dir() else set()

    def assert_sound(self) -> None:
        """Every record is whole, and no temporary file is left anywhere."""
        for key in self.keys():
            verify_record(modaldb.open(self.db).path(key))
        left = [p for p in self.folder.rglob("*") if p.name.startswith(".") or p.suffix in (".part", ".tmp")]
        assert left == []


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """A finished run, up to the trajectory."""
    case = Case(tmp_path_factory.mktemp("made"))
    write_scene(case.scene)
    run(case.scene, db=case.db, out=case.out, until="solve")
    return case


@pytest.fixture
def case(made: Case, tmp_path: Path) -> Case:
    """A copy of the finished run."""
    shutil.copytree(made.folder, tmp_path / "case")
    return Case(tmp_path / "case")


@pytest.fixture
def cold(tmp_path: Path) -> Case:
    """The scene alone."""
    write_scene(tmp_path / "case" / "scene")
    return Case(tmp_path / "case")


Capture = pytest.CaptureFixture[str]


def complaints(stderr: str) -> list[str]:
    """Return what stands on stderr beside the stages' names, without the prefix that each line must have."""
    lines = [line for line in stderr.splitlines() if not line.endswith(" …")]
    assert all(line.startswith("gudgeon: ") for line in lines), stderr
    return [line.removeprefix("gudgeon: ") for line in lines]


def refused(case: Case, capsys: Capture, command: list[str], *, where: Path | str = "") -> list[str]:
    """Run a command that must fail and return its complaints, without the place that each of them must name.

    Args:
        where: What each line begins with; the scene's file if left out.
    """
    before = case.keys()
    assert main(command) == 2
    output = capsys.readouterr()
    lines, place = complaints(output.err), f"{where or case.toml}: "
    assert lines
    assert output.out == ""
    assert before <= case.keys()
    case.assert_sound()
    assert [line for line in lines if not line.startswith(place)] == [], f"every line should begin with '{place}'"
    return [line.removeprefix(place) for line in lines]


# The scene's file


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ("run.durration=1", "run.durration: unknown key; did you mean 'duration'? allowed here: duration, step"),
        ("bdy.skirt.velocity=1", "bdy: unknown key; did you mean 'body'? allowed here: body, contact,"),
        ("component.skirt.geometry.wal=1", "component.skirt.geometry.wal: unknown key; did you mean 'wall'?"),
        ("contact.bore.against.radios=1", "contact.bore.against.radios: unknown key; did you mean 'radius'?"),
        ("run.samples=many", "run.samples: 'many' given; allowed: a whole number"),
        ("run.frames=1", "run.frames: 1 given; input should be greater than or equal to 2"),
        ("run.duration=-1", "run.duration: -1 given; input should be greater than 0"),
        ("run.duration=nan", "run.duration: nan given; input should be "),
        ("run.duration=inf", "run.duration: inf given; input should be a finite number"),
        ("run=3", "run: 3 given; allowed: a table"),
        (
            "component.skirt.geometry.wall=-0.004",
            "component.skirt.geometry.wall: -0.004 given; input should be greater",
        ),
        (
            "component.skirt.geometry.wall=0.05",
            "component.skirt.geometry: wall is 0.05 m, it must be below outer_radius",
        ),
        ("component.skirt.geometry.crown=0.05", "component.skirt.geometry: crown is 0.05 m, it must be below height"),
        ("component.skirt.geometry.kind=cup", "component.skirt.geometry.kind: 'cup' given"),
        ("component.skirt.material.nu=0.5", "component.skirt.material.nu: 0.5 given; input should be less than 0.5"),
        ("component.skirt.material.E=nan", "component.skirt.material.E: nan given; input should be "),
        (
            "component.skirt.modes.reduction=macneel",
            "component.skirt.modes.reduction: 'macneel' given; did you mean 'macneal'? input should be 'mac",
        ),
        (
            "component.skirt.change.update=reuze",
            "component.skirt.change.update: 'reuze' given; did you mean 'reuse'? input should be 'reuse',",
        ),
        (f"{THRUST}.sector_deg=[45, -45]", f"{THRUST}: sector_deg is [45.0, -45.0]; the first value must be below"),
        (f"{THRUST}.sector_deg=[nan, 45]", f"{THRUST}.sector_deg"),
        (f"{THRUST}.kind=traction", f"{THRUST}: kind 'traction' needs spacing [m]"),
        (f"{THRUST}.kind=mean", f"{THRUST}: sector_deg is for 'points' and 'traction' only, the kind is 'mean'"),
        (f"{THRUST}.kind=point", f"{THRUST}.kind: 'point' given; did you mean 'points'? input should be"),
        (f"{THRUST}.spacing=0.01", f"{THRUST}: spacing is for 'traction' only, the kind is 'points'"),
        (f"{THRUST}.spacing=[0.01, 0.0]", f"{THRUST}.spacing.1: 0.0 given; input should be greater than 0"),
        (f"{THRUST}.spacing=wide", f"{THRUST}.spacing: 'wide' given; allowed: a number in m or two numbers"),
        ("component.skirt.change.profile.offset=nan", "component.skirt.change.profile.offset: nan given; input should"),
        (
            f"{SUPPORTS}=[3]",
            f"{SUPPORTS}.0: 3 given; expected the name of a surface, or a table with surface and hold",
        ),
        (
            f'{SUPPORTS}=[{{surface="crown", hold=[]}}]',
            f"{SUPPORTS}.0.hold: [] given; name at least one of x, y, z, rx",
        ),
        ('body.skirt.freedom=["z", "x", "z"]', "body.skirt.freedom: z given more than once; give each once"),
        (f'{SUPPORTS}=[{{surface="crown", hold=["q"]}}]', f"{SUPPORTS}.0.hold.0: 'q' given; input should be 'x', 'y'"),
        (f'{SUPPORTS}=[{{surface="crown", hld=["x"]}}]', f"{SUPPORTS}.0.hld: unknown key; did you mean 'hold'? "),
        (f"{MODES}.normal_count=0", f"{MODES}.normal_count: 0 given; reduction 'macneal' needs 1 or more"),
        (f"{MODES}.reduction=fixed-reference", f"{MODES}.reference: is missing; reduction 'fixed-reference' needs"),
        (f"{MODES}.ritz_count=7", f"{MODES}.ritz_count: 7 given, at least normal_count = 8 vectors are needed"),
        (
            f'{SKIRT}.gauge.g={{station="mid", fibre="top"}}',
            f"{SKIRT}.gauge: g: geometry 'skirt' needs a point or a surf",
        ),
        ("component.skirt.supports=crown", "component.skirt.supports: 'crown' given; allowed: a list"),
        ("body.skirt.component=piston", "body.skirt.component: no component 'piston'; the scene has skirt"),
        ("body.skirt.velocity=[0, 1]", "body.skirt.velocity: [0, 1] given; allowed: three numbers [x, y, z] in m/s"),
        ("body.skirt.velocity=[0, 1, 2, 3]", "body.skirt.velocity: [0, 1, 2, 3] given; allowed: three numbers [x, y"),
        ('body.skirt.velocity=[0, 1, "2mm"]', "body.skirt.velocity.2: '2mm' given; allowed: a number in m/s"),
        (
            "body.skirt.damping.rate=1",
            "body.skirt.damping.rate: unknown key; did you mean 'ratio'? allowed here: ratio,",
        ),
        ("report.full_fe.steps=[]", "report.full_fe.steps: 0 given; allowed: at least 2"),
        ("report.full_fe.step=1", "report.full_fe.step: unknown key; did you mean 'steps'? allowed here: steps,"),
        ("contact.bore.law.stiffness=1", "contact.bore.law.kind: is missing; allowed: 'exact', 'flores', 'gonthier'"),
        ("body.skirt.velocity=[0, 1, nan]", "body.skirt.velocity"),
        ("contact.bore.body=piston", "contact.bore.body: no body 'piston', the scene has skirt"),
        (
            "contact.bore.interface=thrst",
            "contact.bore.interface: no interface 'thrst', did you mean 'thrust'? the component has thrust",
        ),
        (
            "contact.bore.method=penality",
            "contact.bore.method: 'penality' given; did you mean 'penalty'? input should be 'residual'",
        ),
        ("contact.bore.surface_stiffness=0", "contact.bore.surface_stiffness: 0 given; input should be greater"),
        ("contact.bore.against.shape=boar", "contact.bore.against.shape: 'boar' given; did you mean 'bore'"),
        ("contact.bore.against.axis=[0, 0, 0]", "contact.bore.against"),
        ("contact.bore.against.axis=[0, 0, nan]", "contact.bore.against.axis"),
        ("contact.bore.against.origin=[inf, 0, 0]", "contact.bore.against.origin"),
    ],
)
def test_mistake_in_the_scene(setting: str, complaint: str, cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command("run", setting))
    assert line.startswith(complaint)
    assert not cold.db.exists()
    assert not cold.out.exists()


@pytest.mark.parametrize("axis", ["[0.0, 0.0, 0.0]", "[0.0, 0.0, nan]"])
def test_plane_without_direction(axis: str, cold: Case, capsys: Capture) -> None:
    cold.edit('shape = "bore", radius = 0.043', f'shape = "plane", point = [0.0431, 0.0, 0.0], normal = {axis}')
    (line,) = refused(cold, capsys, cold.command("status"))
    assert line.startswith("contact.bore.against")


def test_penalty_without_stiffness(cold: Case, capsys: Capture) -> None:
    cold.edit("surface_stiffness = 1e14", 'method = "penalty"')
    (line,) = refused(cold, capsys, cold.command("run"))
    assert line == "contact.bore: method 'penalty' needs either surface_stiffness [N/m^3] or a law"


def test_all_mistakes_are_listed_at_once(cold: Case, capsys: Capture) -> None:
    cold.edit("duration = 3e-4", "durration = 3e-4")
    cold.edit("wall = 0.006", "wall = -0.006")
    cold.edit("velocity = [0.2, 0.0, 0.0]", 'velocity = "fast"')
    lines = refused(cold, capsys, cold.command("run", "component.skirt.modes.normal_count=few"))
    assert sorted(line.partition(": ")[0] for line in lines) == [
        "body.skirt.velocity",
        "component.skirt.geometry.wall",
        "component.skirt.modes.normal_count",
        "run.duration",
        "run.durration",
    ]


def test_mistakes_between_tables_are_listed_at_once(cold: Case, capsys: Capture) -> None:
    command = cold.command("run", "contact.bore.interface=thrst", "body.second.component=piston")
    assert [line.partition(": ")[0] for line in refused(cold, capsys, command)] == [
        "body.second.component",
        "contact.bore.interface",
    ]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "bore.largest_force",
            "report.quantities: no contact has 'largest_force'; allowed are impulse, impacts, start,",
        ),
        ("bore.force_peek", "report.quantities: no contact has 'force_peek'; did you mean 'bore.force_peak'? allowed"),
        ("bore.impact0.start", "report.quantities: no contact has 'impact0.start'; did you mean 'bore.impactN.start'?"),
        ("skirt.impulse", "report.quantities: no body and component has 'impulse'; allowed are velocity_x,"),
        ("wall.impulse", "report.quantities: 'wall.impulse' belongs to nothing in the scene, which has bore, skirt"),
    ],
)
def test_quantities_that_no_run_has_are_refused(name: str, message: str, cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command("solve", f'report.quantities={{ "{name}" = "x" }}'))
    assert line.startswith(message)


def test_a_probe_has_no_quantity_of_its_contact(cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command("solve", 'probe.bore={ kind = "force", of = "contact.bore" }'))
    assert line == "probe.bore: a contact or joint has 'bore.force_peak' too; give the probe another name"


def test_a_window_within_the_duration(cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command("solve", "run.window=1.0"))
    assert line == "run: window 1 s is longer than the duration, 0.0003 s"


@pytest.mark.parametrize("text", ["run.duration", "=3", ".duration=3", "run..duration=3", ""])
def test_setting_without_path_or_value(text: str, cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command("run", text), where=f"--set {text}")
    assert line == "expected path.to.key=value"


@pytest.mark.parametrize("command", ["mesh", "modes", "morph", "solve", "plot", "run", "status", "plan", "report"])
def test_every_command_checks_the_scene(command: str, cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, cold.command(command, "run.durration=1"))
    assert line.startswith("run.durration: unknown key")


def test_json_is_not_printed_for_a_mistake(cold: Case, capsys: Capture) -> None:
    refused(cold, capsys, [*cold.command("run", "run.durration=1"), "--json"])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"[run\nduration = 1", "not valid TOML: "),
        (b"height,0\n0.0,1e-6\n", "not valid TOML: "),
        (b"[run]\nduration = 1\nduration = 2", "not valid TOML: "),
        (
            b'component.a.geometry = { kind = "cad" }\n[component.a.geometry.surfaces]\n',
            "not valid TOML: [component.a.geometry.surfaces] is declared twice, or a table around it is in braces",
        ),
        (b"[run]\n[run]\n", "not valid TOML: [run] is declared twice"),
        ("# Höhe".encode("latin-1"), "cannot be read (not UTF-8 text)"),
    ],
)
def test_scene_that_is_no_toml(content: bytes, complaint: str, cold: Case, capsys: Capture) -> None:
    cold.toml.write_bytes(content)
    (line,) = refused(cold, capsys, cold.command("run"))
    assert line.startswith(complaint)


def test_empty_scene_lists_what_it_needs(cold: Case, capsys: Capture) -> None:
    cold.toml.write_text("")
    lines = sorted(refused(cold, capsys, cold.command("run")))
    assert [line.partition(": is missing; give a table ")[0] for line in lines] == ["body", "component", "run"]
    assert "run = { duration = 0.001 }" in lines[2]


@pytest.mark.parametrize("name", ["nowhere", "."])
def test_missing_scene(name: str, cold: Case, capsys: Capture) -> None:
    place = cold.folder / name
    (line,) = refused(cold, capsys, ["run", str(place)], where=place)
    assert line == "no scene here; give a folder with scene.toml or a TOML file"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "the following arguments are required: COMMAND"),
        (["mash", "scene"], "COMMAND: invalid choice: 'mash' (did you mean 'mesh'?); see 'gudgeon --help'"),
        (["run"], "the following arguments are required: SCENE"),
        (["run", "scene", "--sett", "a=1"], "unrecognized arguments: --sett a=1 (did you mean '--set'?)"),
        (["run", "scene", "--db"], "argument --db: expected one argument"),
        (["report", "scene", "--repeat", "0"], "argument --repeat: 0 given; expected a whole number, 1 or more"),
        (["export", "scene", "one", "--format", "step"], "--format: invalid choice: 'step'; allowed: "),
    ],
)
def test_mistake_on_the_command_line(arguments: list[str], complaint: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    output = capsys.readouterr()
    assert end.value.code == 2
    (line,) = output.err.splitlines()
    assert complaint in line
    assert line.startswith("gudgeon")
    assert output.out == ""


# What only a stage can find out


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        (f"{THRUST}.surface=skrt", f"{THRUST}.surface: the mesh has no surface 'skrt', it has crown, crown_inner,"),
        (f"{THRUST}.surface=crown", f"{THRUST}: sector_deg and height need a cylinder, 'crown' is none"),
        (f"{THRUST}.sector_deg=[1.0, 1.001]", f"{THRUST}: no contact point of surface 'skirt' lies in its sector"),
        ("component.skirt.modes.normal_count=100000", "component.skirt.modes.normal_count: 100000 "),
        (f"{SUPPORTS}=['hat']", f"{SUPPORTS}: the mesh has no surface 'hat', it has crown, crown_inner, inner,"),
        (f"{SLIDE}={slide(spacing=0.001)}", f"{SLIDE}.spacing: 81 × 35 = 2835 functions, at most 1000; spacing = ["),
        (f"{SLIDE}={slide(height=[0.0, 0.1])}", f"{SLIDE}: 77 functions of the traction space find no surface,"),
        (f"{SLIDE}={slide(surface='inne')}", f"{SLIDE}.surface: the mesh has no surface 'inne', it has crown,"),
    ],
)
def test_modes_stage_refuses(setting: str, complaint: str, case: Case, capsys: Capture) -> None:
    before = case.keys()
    (line,) = refused(case, capsys, case.command("modes", setting))
    assert line.startswith(complaint)
    assert case.keys() == before


def test_profile_below_a_traction_space(case: Case, capsys: Capture) -> None:
    """A profile must not move the surface of a traction space, whatever command needs the profile."""
    for setting in (f"{TABLE}=barrel.csv", "component.skirt.change.profile.offset=1e-5"):
        (line,) = refused(case, capsys, case.command("modes", f"{SLIDE}={slide(surface='skirt')}", setting))
        assert line.startswith(
            f"{MOVED}: 'skirt' carries the traction space interface.slide, so a profile must not move it"
        )


def test_offset_that_inverts_elements(case: Case, capsys: Capture) -> None:
    (line,) = refused(case, capsys, case.command("morph", "component.skirt.change.profile.offset=-0.02"))
    assert line.startswith("component.skirt.change.profile.offset: the profile inverts ")


def test_mesh_needs_a_size(cold: Case, capsys: Capture) -> None:
    cold.edit("mesh = { size = 0.014 }\n", "")
    (line,) = refused(cold, capsys, cold.command("mesh"))
    assert line == "component.skirt.mesh.size: is missing; give an edge length [m]"


def test_no_modes_at_all_is_answered(case: Case, capsys: Capture) -> None:
    """A rigid body with all its flexibility in R, or a refusal; not a traceback."""
    code = main(case.command("modes", "component.skirt.modes.normal_count=0", "component.skirt.modes.static_count=0"))
    lines = complaints(capsys.readouterr().err)
    assert (code, len(lines)) in ((0, 0), (2, 1))
    case.assert_sound()


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        (
            "contact.bore.against.radius=0.0429",
            "contact.bore: 64 of 64 points start inside the obstacle, the worst by",
        ),
        ("body.skirt.position=[1e-3, 0.0, 0.0]", "contact.bore: 64 of 64 points start inside the obstacle, the worst"),
        ("contact.bore.against.axis=[1.0, 0.0, 0.0]", "contact.bore.against: the obstacle does not face interface"),
        (
            "component.skirt.modes.reduction=normal+static",
            "contact.bore.method: 'residual' needs a reduction that stores R",
        ),
    ],
)
def test_solve_stage_refuses(setting: str, complaint: str, case: Case, capsys: Capture) -> None:
    results = {path: path.read_bytes() for path in case.out.iterdir()}
    (line,) = refused(case, capsys, case.command("solve", setting))
    assert line.startswith(complaint)
    assert {path: path.read_bytes() for path in case.out.iterdir()} == results  # the last run's answer stands


def test_contact_points_that_depend_on_each_other(case: Case, capsys: Capture) -> None:
    twin = 'contact.twin={body="skirt", interface="thrust", against={shape="bore", radius=0.043}}'
    command = case.command("solve", twin)
    assert main(command) == 1
    (line,) = complaints(capsys.readouterr().err)
    assert "the contact forces are not unique" in line
    case.assert_sound()


# Profile tables

FULL_TURN = """height_m,-180,-90,0,90,180
0.00,-2.0e-05,-2.0e-05,-2.0e-05,-2.0e-05,-2.0e-05
0.02,0.0,0.0,0.0,0.0,0.0
0.04,-2.0e-05,-2.0e-05,-2.0e-05,-2.0e-05,-2.0e-05"""


def test_whole_table_is_taken(case: Case, capsys: Capture) -> None:
    """The refusals below are not for anything else."""
    assert main(case.command("morph", case.table(FULL_TURN))) == 0
    # The mesh of these tests is a coarse one, and the command says so.
    known = (": the mesh error of the contact's flexibility is about ", ": modes are reused; estimated change of ")
    lines = complaints(capsys.readouterr().err)
    assert all(any(text in line for text in known) for line in lines), lines


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "a profile table needs a row of angles and at least two rows of heights"),
        ("\n\n", "a profile table needs a row of angles and at least two rows of heights"),
        ("height,0\n0.0,1e-6\n", "a profile table needs a row of angles and at least two rows of heights"),
        (FULL_TURN.rsplit(",", 2)[0], "row 4 has 4 cells, the first row has 6; is it cut off?"),
        (FULL_TURN[:-6], "the first and last angle are the same direction but differ in deviation"),
        (FULL_TURN[:-2], "row 4 holds '-2.0e-', a number is needed"),
        (FULL_TURN[:-1], "the first and last angle are the same direction but differ in deviation"),
        (FULL_TURN.rsplit("\n", 1)[0], "heights 0 to 0.02 m do not cover the surface, which reaches from 0 to 0.04 m"),
        (FULL_TURN.replace("0.02,0.0", "0.02,zero"), "row 3 holds 'zero', a number is needed"),
        (FULL_TURN.replace("0.02,0.0", "0.02,nan"), "row 3 holds 'nan', a finite number is needed"),
        (FULL_TURN.replace("0.02,0.0", "0.02,"), "row 3 holds '', a number is needed"),
        (FULL_TURN.replace("-180", "west"), "row 1 holds 'west', a number is needed"),
        (FULL_TURN.replace(",", ";"), "a profile table needs a row of angles and at least two rows of heights"),
        (FULL_TURN.replace("180", "170"), "angles must span 360 degrees in at least 4 columns, they span 340"),
        (FULL_TURN.replace("0.02,", "0.05,"), "heights and angles must increase"),
        (FULL_TURN.replace("0.04,", "0.03,"), "heights 0 to 0.03 m do not cover the surface, which reaches from 0 to"),
        ("height,0\n0.0,0.0\n0.04,-2e-", "row 3 holds '-2e-', a number is needed"),
    ],
)
def test_table_is_refused(text: str, complaint: str, case: Case, capsys: Capture) -> None:
    before = case.keys()
    (line,) = refused(case, capsys, case.command("morph", case.table(text)), where=case.scene / "table.csv")
    assert line.startswith(complaint)
    assert case.keys() == before


@pytest.mark.parametrize("content", [b"h\xf6he,0\n0,0\n0.04,0\n", bytes(range(256)) * 4])
def test_table_that_is_no_text(content: bytes, case: Case, capsys: Capture) -> None:
    setting = case.table("")
    (case.scene / "table.csv").write_bytes(content)
    (line,) = refused(case, capsys, case.command("morph", setting), where=case.scene / "table.csv")
    assert line.startswith("profile table cannot be read")


@pytest.mark.parametrize("command", ["morph", "run", "status", "plan"])
def test_missing_table(command: str, case: Case, capsys: Capture) -> None:
    (line,) = refused(case, capsys, case.command(command, f"{TABLE}=none.csv"))
    assert line == f"{TABLE}: no file 'none.csv', neither in {case.scene} nor in the current folder"


@pytest.mark.parametrize("update", ["reuse", "recompute"])
def test_profile_that_inverts_elements(update: str, case: Case, capsys: Capture) -> None:
    before = case.keys()
    settings = (f"{TABLE}=barrel.csv", f"{SCALE}=1000", f"component.skirt.change.update={update}")
    (line,) = refused(case, capsys, case.command("morph", *settings))
    found = re.fullmatch(
        rf"{TABLE}: the profile inverts (\d+) elements, the worst is element (\d+) near \(.*\) m; allowed: .+",
        line,
    )
    assert found
    job = open_job(case.scene, db=case.db)
    cells = len(job.store.get(job.components()["skirt"]["mesh"].key, "mesh").cells)
    assert 0 < int(found[1]) <= cells
    assert int(found[2]) < cells
    assert case.keys() == before


@pytest.mark.parametrize(
    ("surface", "complaint"),
    [
        ("crwn", "the mesh has no surface 'crwn', it has crown, crown_inner, inner, open_end, skirt"),
        (
            "crown",
            "'crown' is no cylinder, a profile needs one; a cylinder of a mesh file must be declared in"
            " geometry.surfaces",
        ),
    ],
)
def test_profile_on_a_surface_that_cannot_move(surface: str, complaint: str, case: Case, capsys: Capture) -> None:
    (line,) = refused(case, capsys, case.command("morph", f"{TABLE}=barrel.csv", f"{MOVED}={surface}"))
    assert line == f"{MOVED}: {complaint}"


# Mesh files


@pytest.fixture
def meshed(case: Case) -> Case:
    """The scene with its component from the file part.msh, which is whole."""
    job = open_job(case.scene, db=case.db)
    mesh = job.store.get(job.components()["skirt"]["mesh"].key, "mesh")
    whole = meshio.Mesh(mesh.nodes, [("tetra10", mesh.cells)])
    whole.write(case.scene / "part.msh", file_format="gmsh22", binary=False)
    shape = "{ skirt = { kind = 'cylinder', radius = 0.04296, axis = [0.0, 0.0, 1.0], origin = [0.0, 0.0, 0.0] } }"
    case.edit(GEOMETRY, f"geometry = {{ kind = 'file', path = 'part.msh', unit = 1.0, surfaces = {shape} }}")
    return case


def test_whole_mesh_file_is_taken(meshed: Case, capsys: Capture) -> None:
    """The refusals below are not for anything else."""
    assert main(meshed.command("mesh")) == 0
    assert complaints(capsys.readouterr().err) == []


@pytest.mark.parametrize("command", ["run", "status"])
def test_mesh_file_is_missing(command: str, meshed: Case, capsys: Capture) -> None:
    (meshed.scene / "part.msh").unlink()
    (line,) = refused(meshed, capsys, meshed.command(command))
    assert (
        line
        == f"component.skirt.geometry.path: no file 'part.msh', neither in {meshed.scene} nor in the current folder"
    )


@pytest.mark.parametrize("content", [b"", b"hello\n", b"height,0\n0,0\n", bytes(range(256)) * 8, b"$MeshFormat\n"])
def test_mesh_file_is_no_mesh(content: bytes, meshed: Case, capsys: Capture) -> None:
    (meshed.scene / "part.msh").write_bytes(content)
    refused(meshed, capsys, meshed.command("run"), where=meshed.scene / "part.msh")


@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.7, 0.99])
def test_mesh_file_is_cut_off(share: float, meshed: Case, capsys: Capture) -> None:
    content = (meshed.scene / "part.msh").read_bytes()
    (meshed.scene / "part.msh").write_bytes(content[: int(share * len(content))])
    refused(meshed, capsys, meshed.command("run"), where=meshed.scene / "part.msh")


def test_mesh_file_of_another_size(meshed: Case, capsys: Capture) -> None:
    (line,) = refused(meshed, capsys, meshed.command("run", "component.skirt.geometry.unit=1e-3"),
                      where=meshed.scene / "part.msh")  # fmt: skip
    assert "surface 'skirt'" in line
    assert "check `unit`" in line


# The database


def _record_files(case: Case) -> dict[str, Path]:
    job = open_job(case.scene, db=case.db)
    keys = {step: product.key for step, product in job.components()["skirt"].items()}
    return {step: job.store.path(key) for step, key in (keys | {"solve": job.trajectory().key}).items()}


@pytest.mark.parametrize("command", ["solve", "status"])
@pytest.mark.parametrize("stage", ["mesh", "modes", "morph", "solve"])
def test_flipped_byte_in_the_database(
    stage: str, command: str, case: Case, capsys: Capture, caplog: pytest.LogCaptureFixture
) -> None:
    path, keys = _record_files(case)[stage], case.keys()
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert main(case.command(command)) == 0
    fault, aside = f"{path}: checksum differs from the one written", path.with_suffix(".damaged")
    if command == "solve":
        assert caplog.messages == [f"{fault}; renamed to {aside.name}"]
    else:
        assert fault in capsys.readouterr().out
        assert not aside.exists()
        assert main(case.command("solve")) == 0
    assert aside.is_file()
    assert case.keys() == keys
    case.assert_sound()


def test_database_that_is_a_file(cold: Case, capsys: Capture) -> None:
    cold.db.write_text("a file")
    (line,) = refused(cold, capsys, cold.command("run"), where=cold.db)
    assert line == "not a folder"
    assert cold.db.read_text() == "a file"


@pytest.mark.parametrize("url", ["ftp://host/db", "http://", "http://host:port", "http://host/a/b", "http://u@host"])
def test_database_at_no_url(url: str, cold: Case, capsys: Capture) -> None:
    (line,) = refused(cold, capsys, [*cold.command("run"), "--db", url], where=url)
    assert line == "no URL of a database; expected http://HOST:PORT or http://HOST:PORT/NAME"


def test_database_that_does_not_answer(cold: Case, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_DB_WAIT", "0.2")
    with socket.socket() as taken:  # Bound, and nobody listens.
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}"
        (line,) = refused(cold, capsys, [*cold.command("run"), "--db", url], where=url)
    assert re.fullmatch(r"no answer in 0\.\d s \(Connection refused\)", line)


def test_database_below_a_file(cold: Case, capsys: Capture) -> None:
    (cold.folder / "file").write_text("a file")
    command = [*cold.command("mesh"), "--db", str(cold.folder / "file" / "db")]
    assert main(command) == 2
    (line,) = complaints(capsys.readouterr().err)
    assert line.startswith(str(cold.folder / "file" / "db"))
    assert "cannot be written" in line


# The results


@pytest.mark.parametrize("command", ["mesh", "solve"])
@pytest.mark.parametrize("below", ["", "out"])
def test_results_that_cannot_be_written(below: str, command: str, case: Case, capsys: Capture) -> None:
    (case.folder / "file").write_text("a file")
    place = case.folder / "file" / below
    assert main([*case.command(command), "--out", str(place)]) == 2
    output = capsys.readouterr()
    (line,) = complaints(output.err)
    assert line.startswith(str(place))
    assert "cannot be written" in line
    assert output.out == ""
    assert (case.folder / "file").read_text() == "a file"
    case.assert_sound()


@pytest.mark.parametrize("name", ["summary.json", "trajectory.h5", "inputs.json"])
def test_a_folder_in_the_place_of_a_result(name: str, case: Case, capsys: Capture) -> None:
    shutil.rmtree(case.out)
    (case.out / name).mkdir(parents=True)
    (line,) = refused_results(case, capsys)
    assert line.startswith(f"{case.out / name}: cannot be written")
    case.assert_sound()


def refused_results(case: Case, capsys: Capture) -> list[str]:
    """Run the solve stage, which cannot write its results, and return its complaints."""
    assert main(case.command("solve")) == 2
    return complaints(capsys.readouterr().err)


@pytest.mark.parametrize("content", [None, "no JSON", "{}", '{"expected": {}}'])
def test_reference_file_that_is_none(content: str | None, case: Case, capsys: Capture) -> None:
    case.toml.write_text(
        case.toml.read_text() + '\n[report]\nreference = "r.json"\nquantities = { "bore.impulse" = "impulse" }\n'
    )
    shutil.rmtree(case.out)
    if content is None:
        (line,) = refused(case, capsys, case.command("solve"))
        assert line == f"report.reference: no file 'r.json', neither in {case.scene} nor in the current folder"
    else:
        (case.scene / "r.json").write_text(content)
        (line,) = refused(case, capsys, case.command("solve"), where=case.scene / "r.json")
        assert line.startswith("not a reference file with these quantities")


# Ctrl-C

INTERRUPTED = """
import os, pkgutil, signal, sys, time
from gudgeon.pipeline.cli import main
def interrupted(*arguments, **options):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
setattr(pkgutil.resolve_name(sys.argv[1]), sys.argv[2], interrupted)
sys.exit(main(sys.argv[3:]))
"""
"""A command during which Ctrl-C comes just when one function is called."""


def _child(arguments: list[str]) -> subprocess.Popen[str]:
    # A shell's background job ignores SIGINT, and a child would inherit that.
    return subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def _assert_interrupted(case: Case, code: int, stdout: str, stderr: str, stage: str) -> None:
    (line,) = complaints(stderr)
    where = f" in stage {stage}" if stage else ""
    assert line == f"interrupted{where}; {KEPT}"
    assert code == 1
    assert stdout == ""
    case.assert_sound()


def _without(case: Case, *steps: str) -> None:
    """Remove records, so that their stages must run."""
    for step, path in _record_files(case).items():
        if step in steps:
            path.unlink()


@pytest.mark.parametrize(
    ("stage", "missing", "settings"),
    [
        ("mesh", ("mesh", "modes", "morph", "solve"), ()),
        ("modes", ("modes", "morph", "solve"), ()),
        ("solve", (), ("run.duration=10", "run.limits.angle=1e6", "run.limits.offset=1e6")),
        ("plot", (), ()),
    ],
)
def test_interrupt_in_a_stage(
    stage: str, missing: tuple[str, ...], settings: tuple[str, ...], case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    _without(case, *missing)
    kept = case.keys()
    with _child(["-m", "gudgeon.pipeline", *case.command("run", *settings)]) as child:
        assert child.stderr is not None
        assert child.stdout is not None
        assert any(line == f"{stage} …\n" for line in child.stderr)
        child.send_signal(signal.SIGINT)
        stdout, stderr = child.communicate(timeout=PATIENCE)
    _assert_interrupted(case, child.returncode, stdout, stderr, stage)
    assert case.keys() == kept
    monkeypatch.setitem(PLOTS, "rendered", {})
    monkeypatch.delitem(PLOTS, "rendered")
    assert main(case.command("run" if stage == "plot" else "solve")) == 0
    case.assert_sound()


@pytest.mark.parametrize(
    ("module", "function", "missing", "stage"),
    [
        ("gudgeon.pipeline.stages.mesh", "build_mesh", ("mesh", "modes", "morph", "solve"), "mesh"),
        ("gudgeon.pipeline.reduction.reduce", "reduce_component", ("modes", "morph", "solve"), "modes"),
        ("gudgeon.pipeline.design_change.morph", "own_modes", ("morph", "solve"), "morph"),
        ("gudgeon.solver.simulate", "simulate", ("solve",), "solve"),
        ("gudgeon.pipeline.plots", "render", (), "plot"),
        ("os", "fsync", ("morph",), "morph"),
        ("os", "fsync", ("solve",), ""),
        ("shutil", "copyfileobj", ("solve",), ""),
        ("os", "replace", (), ""),
        ("pathlib.Path", "write_text", (), ""),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, tuple) else value,
)
def test_interrupt_at_a_function(module: str, function: str, missing: tuple[str, ...], stage: str, case: Case) -> None:
    """Also where a stage is too quick to be hit, and in the middle of writing a record or a result."""
    _without(case, *missing)
    shutil.rmtree(case.out)
    with _child(["-c", INTERRUPTED, module, function, *case.command("run")]) as child:
        stdout, stderr = child.communicate(timeout=PATIENCE)
    _assert_interrupted(case, child.returncode, stdout, stderr, stage)
    assert main(case.command("solve")) == 0
    case.assert_sound()


def test_interrupt_of_the_next_command_names_no_old_stage(case: Case, monkeypatch: pytest.MonkeyPatch,
                                                          capsys: Capture) -> None:  # fmt: skip
    """A notebook runs several commands in one process."""
    assert main(case.command("solve", "contact.bore.against.radius=0.0429")) == 2
    capsys.readouterr()

    def interrupted(*arguments: object, **options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gudgeon.pipeline.kinds.open_job", interrupted)
    assert main(case.command("status")) == 1
    assert complaints(capsys.readouterr().err) == [f"interrupted; {KEPT}"]


def test_checks_of_this_file_can_fail(case: Case) -> None:
    case.assert_sound()
    (case.out / ".summary.json.x1").write_text("")
    with pytest.raises(AssertionError):
        case.assert_sound()
    (case.out / ".summary.json.x1").unlink()
    path = next(iter(_record_files(case).values()))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(modaldb.RecordDamaged):
        case.assert_sound()
    with pytest.raises(AssertionError):
        complaints("Traceback (most recent call last):\n")
