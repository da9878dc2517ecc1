"""Reference cases B1 and B2: a ball falls on a simply supported beam, in one impact and in one that is three.

S. P. Timoshenko, Z. Math. Phys. 62 (1913) 198; W. P. Mason, J. Appl. Mech. 3 (1936) A55. Values from the Volterra
equation over modal series, in data/beam-sphere/B*.json.
"""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.geometry.shapes.box import Box
from tests.scenes import reference
from tests.validation.solved import solve

CASES = [
    ("scene.toml", "B2_timoshenko1913_long", "euler_bernoulli", 2e-6),
    ("timoshenko.toml", "B2_timoshenko1913_long", "timoshenko_beam_kappa_5_6", 5e-5),
    ("short.toml", "B1_timoshenko1913_short", "euler_bernoulli", 2e-6),
    ("short-timoshenko.toml", "B1_timoshenko1913_short", "timoshenko_beam_kappa_5_6", 5e-5),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("beam")


@pytest.mark.parametrize(("scene", "name", "theory", "bound"), CASES, ids=[case[0] for case in CASES])
def test_every_impact(folder: Path, scene: str, name: str, theory: str, bound: float) -> None:
    """0.5 % is asked; the reference's own uncertainty is 1e-7 for Euler-Bernoulli and 6e-6 for Timoshenko."""
    exact, solved = reference(f"beam-sphere/{name}.json")[theory], solve(f"beam-sphere/{scene}", folder)
    episodes, impacts = exact["episodes"], solved.impacts("pair")
    assert len(impacts) == len(episodes) == exact["number_of_contacts"]
    for impact, episode in zip(impacts, episodes, strict=True):
        assert impact[0] == pytest.approx(episode["t_start"], rel=bound, abs=1e-12)
        assert impact[1] == pytest.approx(episode["t_end"], rel=bound)
        assert impact[2] == pytest.approx(episode["impulse"], rel=bound)
        assert impact[3] == pytest.approx(episode["Fmax"], rel=bound)
        assert impact[4] == pytest.approx(episode["t_Fmax"], rel=100 * bound)
    assert solved["ball.velocity_z"] == pytest.approx(-exact["ball_velocity_after"]["value"], rel=bound)
    assert solved.history.momentum_residual < 1e-12


def test_solid_beam(folder: Path) -> None:
    """A tet10 solid against the Timoshenko values: 3 %; times come within 0.3 %, forces within 1.7 %.

    The mean displacement of a patch stands for the beam's: the mesh adds next to nothing to Hertz's compliance.
    """
    exact = reference("beam-sphere/B2_timoshenko1913_long.json")["timoshenko_beam_kappa_5_6"]
    solved = solve("beam-sphere/solid.toml", folder)
    impacts, episodes = solved.impacts("pair"), exact["episodes"]
    assert len(impacts) == len(episodes)
    for impact, episode in zip(impacts, episodes, strict=True):
        assert impact[0] == pytest.approx(episode["t_start"], rel=1e-2, abs=1e-12)
        assert impact[1] == pytest.approx(episode["t_end"], rel=1e-2)
        assert impact[2] == pytest.approx(episode["impulse"], rel=1e-2)
        assert impact[3] == pytest.approx(episode["Fmax"], rel=3e-2)
    assert solved["ball.velocity_z"] == pytest.approx(-exact["ball_velocity_after"]["value"], rel=1e-2)


def test_patch_of_a_box() -> None:
    """The patch is the rectangle that was asked for, part of the top."""
    mesh = Box(kind="box", lx=0.3, ly=0.1, lz=0.1, patch=(0.05, 0.04)).build(0.05)
    corners = mesh.nodes[mesh.surfaces["patch"].facets[:, :3]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(0.05 * 0.04, rel=1e-12)
    np.testing.assert_allclose(corners[..., 2], 0.1, rtol=1e-12)
    assert np.abs(corners[..., :2]).max(axis=(0, 1)) == pytest.approx([0.025, 0.02], rel=1e-12)
    top, patch = ({tuple(row) for row in mesh.surfaces[name].facets.tolist()} for name in ("top", "patch"))
    assert patch < top
    with pytest.raises(ValueError, match="longer than ly"):
        Box(kind="box", lx=0.3, ly=0.1, lz=0.1, patch=(0.05, 0.2))
