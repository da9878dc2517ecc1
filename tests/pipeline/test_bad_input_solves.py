"""Static answers that do not balance their loads, and mistakes on every kind of part: errors that name the part."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import Solver, condense, factorise
from gudgeon.pipeline.modes import flexibility
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
SECTION = '{ kind = "rectangle", width = 0.02, height = 0.04 }'
PARTS = {
    "box": '{ kind = "box", lx = 0.04, ly = 0.02, lz = 0.02 }',
    "sheet": '{ kind = "rectangle", lx = 0.04, ly = 0.02, thickness = 0.002 }',
    "bar": '{ kind = "bar", length = 1.0, area = 1e-4 }',
    "beam": f'{{ kind = "beam", theory = "euler-bernoulli", length = 1.0, section = {SECTION} }}',
    "timoshenko": f'{{ kind = "beam", length = 1.0, theory = "timoshenko", section = {SECTION} }}',
}
SIZES = {"box": 0.02, "sheet": 0.02}
SCENE = """
[component.arm]
geometry = {geometry}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {size} }}
interface.tip = {{ surface = "{surface}" }}
modes = {{ normal_count = 4 }}

[body.arm]

[run]
duration = 1e-4
"""
ARM = "component.arm"
MODES = f"{ARM}.modes"

Capture = pytest.CaptureFixture[str]
Command = Callable[..., tuple[int, str]]


@pytest.fixture
def modes_of(tmp_path: Path, capsys: Capture) -> Command:
    """Run `gudgeon modes` on a part with some keys changed; returns its exit code and its one complaint."""

    def command(part: str, *sets: str) -> tuple[int, str]:
        surface = "right-top" if part in ("beam", "timoshenko") else "right"
        text = SCENE.format(geometry=PARTS[part], size=SIZES.get(part, 0.1), surface=surface)
        (tmp_path / "scene.toml").write_text(text)
        settings = [text for item in sets for text in ("--set", item)]
        code = main(["modes", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), *settings])
        lines = [line for line in capsys.readouterr().err.splitlines() if not line.endswith(" …")]
        if code == 0:
            return code, ""
        (line,) = lines
        place = f"gudgeon: {tmp_path / 'scene.toml'}: "
        assert line.startswith(place)
        store = modaldb.open(tmp_path / "db")
        assert all("angular_frequencies" not in store.sizes(key) for key in [*store.keys()])
        return code, line.removeprefix(place)

    return command


@pytest.mark.parametrize("part", PARTS)
def test_parts_are_sound(part: str, modes_of: Command) -> None:
    """The refusals below are not for anything else."""
    assert modes_of(part) == (0, "")


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        (["material.nu=0.5"], f"{ARM}.material.nu: 0.5 given; input should be less than 0.5"),
        (["material.rho=-7850"], f"{ARM}.material.rho: -7850 given; input should be greater than 0"),
        (
            ["material.rho=7.85e-9"],
            f"{ARM}.material: E = 2.1e+11 Pa and rho = 7.85e-09 kg/m^3 give a wave speed √(E/rho) of ",
        ),
        (["modes.normal_count=5000"], f"{MODES}.normal_count: 5000 given, its mesh has "),
        (["modes.normal_count=5000", 'supports=["left"]'], f"{MODES}.normal_count: 5000 given, its mesh has "),
        (
            ["modes.reduction=craig-bampton", "modes.fixed_count=5000"],
            f"{MODES}.fixed_count: 5000 given, substructure 0 has ",
        ),
        (
            ["modes.reduction=craig-bampton", "modes.substructures=500"],
            f"{MODES}.substructures: 500 given, the mesh has ",
        ),
        (
            ["modes.reduction=interface", "modes.interface_count=500"],
            f"{MODES}.interface_count: 500 given, the boundary ",
        ),
        (["modes.reduction=attachment", "modes.normal_count=60"], f"{MODES}.normal_count: 60 given, "),
        (['supports=["nowhere"]'], f"{ARM}.supports: the mesh has no surface 'nowhere', it has "),
    ],
    ids=lambda value: "" if isinstance(value, str) else " ".join(value),
)
def test_mistakes_name_the_part(part: str, settings: list[str], complaint: str, modes_of: Command) -> None:
    code, line = modes_of(part, *(f"{ARM}.{item}" for item in settings))
    assert code == 2
    assert line.startswith(complaint)


def test_geometry_that_cannot_be_meshed(modes_of: Command) -> None:
    code, line = modes_of("box", f"{ARM}.geometry.lz=1e-7")
    assert code == 1
    assert line.startswith(f"{ARM}.geometry: gmsh: ")


def test_plate_of_slivers(modes_of: Command) -> None:
    """Aspect 2000: round-off mixes rigid and elastic modes."""
    code, line = modes_of("box", f"{ARM}.geometry.lz=1e-5")
    assert code == 1
    assert line.startswith(f"{ARM}: modes: rigid and elastic modes cannot be separated")


@pytest.mark.parametrize("supports", ["[]", '["left"]'])
def test_beam_of_far_too_many_elements(supports: str, modes_of: Command) -> None:
    """Statics alone: the error of K⁻¹ is round-off times the third power of the number of elements."""
    changes = (f"{MODES}.reduction=attachment", f"{MODES}.normal_count=0", f"{ARM}.supports={supports}")
    code, line = modes_of("beam", *changes, f"{ARM}.mesh.size=2e-4", f"{ARM}.geometry.length=1.0001")
    assert code == 1
    assert line.startswith(f"{ARM}: modes: static solutions leave ")
    assert "of their load unbalanced, allowed: 1e-05. " in line
    assert modes_of("beam", *changes) == (0, "")


# Answers


@pytest.mark.parametrize("reduction", ["macneal", "rubin", "ritz", "attachment", "normal+static"])
def test_static_answers_that_are_wrong(reduction: str, modes_of: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """One answer of a block is off by 1e-4: no record is made of it."""
    monkeypatch.setattr(flexibility, "factorise", lambda *given, **named: sloppy(factorise(*given, **named)))
    monkeypatch.setattr(flexibility, "condense", lambda *given: sloppy(condense(*given)))
    count = 0 if reduction == "attachment" else 4
    code, line = modes_of(
        "box", f"{MODES}.reduction={reduction}", f"{MODES}.normal_count={count}", f"{MODES}.static_count=3"
    )
    assert code == 1
    assert line.startswith(f"{ARM}: modes: static solutions leave ")


def sloppy(factor: Solver | None) -> Solver | None:
    """Make the last answer of each call too large."""
    if factor is None:
        return None
    whole = factor.solve

    def solve(loads: np.ndarray) -> np.ndarray:
        answer = whole(loads)
        answer[:, -1] *= 1 + 1e-4
        return answer

    factor.solve = solve
    return factor


def test_statics_of_a_mechanism(hinge: FEModel) -> None:
    """The stiffness of its free dofs is singular: a load along the free motion has no answer."""
    with pytest.raises(StageError, match=r"the stiffness matrix .* is singular to machine precision"):
        Flexibility(hinge)


@pytest.mark.parametrize("reduction", ["attachment", "ritz"])
def test_reductions_without_normal_modes_refuse_a_mechanism(reduction: str, hinge: FEModel) -> None:
    far = np.array([int(np.argmin(hinge.nodes[:, 0]))])
    rows = ContactRows(hinge.rows(far, np.array([[0.0, 1.0, 0.0]])), np.eye(1))
    with pytest.raises(StageError, match=r"static solutions leave|singular"):
        REDUCTIONS[reduction](
            hinge, rows, ModesSettings(reduction=reduction, normal_count=0 if reduction == "attachment" else 2)
        )
