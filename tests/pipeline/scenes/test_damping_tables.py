"""Tables of damping ratios over frequency, read from CSV, and what full FE supports of damping."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline.small import rod_scene

TABLE = "frequency [Hz],ratio\n100,0.01\n1e6,0.05\n"


def job_of(folder: Path, table: str = TABLE, **damping: object) -> Job:
    (folder / "scene.toml").write_text(rod_scene(0.1, 4, 400, 20))
    (folder / "damping.csv").write_text(table)
    given = damping or {"table": "damping.csv"}
    return open_job(folder, set={"body.rod.damping": given}, db=folder / "db", out=folder / "out")


def test_a_table_gives_the_ratio_of_each_coordinate(tmp_path: Path) -> None:
    job = job_of(tmp_path)
    run_job(job, "morph")
    system = system_of(job)
    omega = np.sqrt(system.stiffness[system.stiffness > 0])
    expected = 2 * omega * np.interp(omega / (2 * np.pi), [100, 1e6], [0.01, 0.05])
    np.testing.assert_allclose(system.damping[system.stiffness > 0], expected, rtol=1e-14)
    assert run_job(job, "solve").result == "FINISHED"


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ("f,r\n100,0.01\n", "a table of frequency [Hz] and damping ratio needs a header and at least two rows"),
        ("f,r\n100,0.01\n1e6\n", "row 3 has 1 cells, frequency [Hz] and damping ratio are needed"),
        ("f,r\n100,0.01\n90,0.02\n", "row 3: 90 must be above 100 of the row before"),
        ("f,r\n100,0.01\n1e6,1.5\n", "row 3: 1.5 given; input should be less than 1"),
        ("f,r\n0,0.01\n1e6,0.5\n", "row 2: 0 given; input should be greater than 0"),
        ("f,r\n100,x\n1e6,0.5\n", "row 2"),
    ],
)
def test_a_wrong_table_is_refused(table: str, line: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        job_of(tmp_path, table)
    assert line in str(caught.value)
    assert "damping.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_full_fe_names_the_damping_that_it_has(tmp_path: Path) -> None:
    job = job_of(tmp_path, ratio=0.01)
    run_job(job, "morph")
    with pytest.raises(InputError, match=r"body\.rod\.damping: full FE has damping proportional"):
        nodal_problem(job)
    job = job_of(tmp_path, beta=1e-7)
    assert nodal_problem(job).bodies[0].damping == 1e-7  # type: ignore[union-attr]
