"""`python -m docs.tools.basis_reductions`: estimated errors of bases of few modes and static shapes, for docs/basis.md.

A column strikes with its end; the force is that of 60 normal modes but for what a basis lacks. Prints the table.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from gudgeon.pipeline.kinds import run

COLUMN = """
component.part.geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.1 }
component.part.mesh.size = 0.01
component.part.material = { E = 110e9, nu = 0.34, rho = 4500 }
component.part.interface.foot.surface = "bottom"
component.part.modes.reduction = "macneal"
body.part = { position = [0, 0, 1e-5], velocity = [0, 0, -0.3] }
contact.floor.body = "part"
contact.floor.interface = "foot"
contact.floor.surface_stiffness = 1e13
contact.floor.against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
run = { duration = 2e-4, window = 4e-6 }
"""
BASES: tuple[dict[str, Any], ...] = (
    {"reduction": "macneal", "normal_count": 5},
    {"reduction": "macneal", "normal_count": 10},
    {"reduction": "rubin", "normal_count": 5},
    {"reduction": "rubin", "normal_count": 10},
    {"reduction": "craig-bampton"},
    {"reduction": "craig-bampton", "normal_count": 0, "fixed_count": 60},
    {"reduction": "row-craig-bampton"},
    {"reduction": "attachment", "normal_count": 0},
)


def solved(folder: Path, **modes: Any) -> tuple[float, float]:
    """Return the largest force [N] and its estimated relative error of a basis."""
    changes = {f"component.part.modes.{key}": value for key, value in modes.items()}
    found = run(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out", until="solve")
    return float(found.quantities["floor.force_peak"]["value"]), float(found.estimates["basis.force"])


def main() -> None:
    """Print all."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.toml").write_text(COLUMN)
        exact, _ = solved(folder, normal_count=60)
        print(f"60 normal modes: {exact / 1e3:.2f} kN")
        for basis in BASES:
            peak, estimate = solved(folder, **basis)
            print(f"| {basis} | {peak / 1e3:.2f} kN | {abs(peak - exact) / peak:.1%} ({estimate:.1%}) |", flush=True)


if __name__ == "__main__":
    main()
