"""A beam on a joint, bent by what acts on its end: closed forms of a cantilever."""

from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

ARM = """
[component.arm]
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.25
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 2 }
[component.arm.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 1.0
motion = "space"
section = { kind = "rectangle", width = 0.02, height = 0.02 }
[component.arm.interface]
root = { surface = "left", kind = "tie", tie = "rbe2" }
tip = { surface = "right", kind = "tie", tie = "rbe2" }

[body.arm]
position = [0.0, 0.0, 0.0]
damping = { ratio = 0.4, frequency = 10.0 }

[joint.clamp]
kind = "fixed"
body = "arm"
interface = "root"

[probe.tip]
kind = "displacement"
body = "arm"
interface = "tip"

[run]
duration = 0.3
samples = 60
frames = 5
"""
BENDING = 3 * 210e9 * 0.02**4 / 12
"""Force over deflection of the end of a cantilever of length 1 [N/m]."""
ACTS = {
    "wrench": ('kind = "wrench"\nforce = [0.0, 0.0, -20.0]\n', -20.0 / BENDING),
    "moment": ('kind = "wrench"\nmoment = [0.0, 20.0, 0.0]\n', -1.5 * 20.0 / BENDING),
    "spring": (
        'kind = "spring"\nagainst_at = [1.0, 0.0, 1.0]\nstiffness = 5e3\npreload = 20.0\n', 20.0 / (BENDING + 5e3),
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "what", [pytest.param(name, marks=pytest.mark.validation if name == "spring" else ()) for name in ACTS]
)
def test_the_end_comes_to_rest_where_it_must(what: str, tmp_path: Path) -> None:
    text, expected = ACTS[what]
    path = tmp_path / "arm.toml"
    path.write_text(f'{ARM}\n[force.act]\nbody = "arm"\ninterface = "tip"\n{text}')
    found = run(path, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert found.result == "FINISHED"
    last = (tmp_path / "out" / "probes.csv").read_text().splitlines()[-1].split(",")
    assert float(last[3]) == pytest.approx(expected, rel=2e-3)


def test_a_basis_without_static_shapes_is_refused(tmp_path: Path) -> None:
    from gudgeon.pipeline.errors import InputError

    path = tmp_path / "arm.toml"
    modes = ARM.replace('reduction = "row-craig-bampton", normal_count = 0, fixed_count = 2', 'reduction = "macneal"')
    path.write_text(f'{modes}\n[force.act]\nbody = "arm"\ninterface = "tip"\n{ACTS["wrench"][0]}')
    with pytest.raises(InputError, match=r"so that joint\.clamp would act on a body that is too stiff"):
        run(path, db=tmp_path / "db", out=tmp_path / "out")


def test_an_unknown_interface_is_said_once(tmp_path: Path) -> None:
    from gudgeon.pipeline.errors import InputError

    path = tmp_path / "arm.toml"
    path.write_text(f'{ARM}\n[force.act]\nbody = "arm"\ninterface = "tipp"\n{ACTS["spring"][0]}')
    with pytest.raises(InputError) as found:
        run(path, db=tmp_path / "db", out=tmp_path / "out")
    assert str(found.value).count("no interface 'tipp'") == 1
