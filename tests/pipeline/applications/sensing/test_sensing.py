"""Calibrations against reference J1, least squares of made data, bridges, and tables that are refused."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.sensing.bridges import bridge_matrix, measured
from gudgeon.pipeline.applications.sensing.calibration import calibrated, read_calibration, write_calibration
from gudgeon.pipeline.applications.sensing.job import infer, of_data
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.gauge import WRENCH, Channel, Sensor
from tests.scenes import reference, scene_path

EXPECTED = reference("base-sensor/J1_spoked_plate.json")
STRAINS = np.array(EXPECTED["strain_per_wrench_8x6_euler_bernoulli"])
NAMES = [f"{side}{spoke}" for spoke in range(4) for side in ("top", "side")]
CHANNELS: list[dict[str, Any]] = [{"name": name, "wiring": "quarter", "gauges": []} for name in NAMES]


def columned(names: Sequence[str], rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of rows by name."""
    return dict(zip(names, rows.T, strict=True))


def table(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """Write columns as CSV."""
    rows = np.column_stack(list(columns.values()))
    path.write_text(",".join(columns) + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n")
    return path


def written(folder: Path) -> Path:
    """Write the calibration of J1, gauge factor 4, so that signals are strains."""
    found = calibrated(CHANNELS, WRENCH, STRAINS, np.full(8, 1e-6), {}, {})
    write_calibration(folder / "c.json", found)
    return folder / "c.json"


def test_the_calibration_of_a_scene_is_that_of_the_reference(tmp_path: Path) -> None:
    """k/4 = 1/2 of a quarter bridge with gauge factor 2: twice the matrix of strains; exact beams, round-off left."""
    scene, out = scene_path("base-sensor") / "plate-beams.toml", tmp_path / "out"
    assert main(["calibrate", str(scene), "--db", str(tmp_path / "db"), "--out", str(out)]) == 0
    found = read_calibration(out / "calibration.json")
    expected = 2 * np.array(EXPECTED["calibration_6x8_euler_bernoulli"])
    assert found.names == NAMES
    size = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found.matrix / size, expected / size, atol=1e-9)
    place = found.channels[1]["gauges"][0]
    assert place["point"] == pytest.approx([0.042, 0.006, 0.0])
    assert place["direction"] == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("setting", [[], ["component.plate.point_mass.lid={surface = 'hub', mass = 0.5}"]])
def test_the_mesh_of_tied_spokes_is_listed_as_one_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], setting: list[str]
) -> None:
    """Four spokes of 60 x 12 x 10 mm; the parts of a frame that a tie joins are one body for every command."""
    given = [part for one in setting for part in ("--set", one)]
    scene = scene_path("base-sensor") / "plate-beams.toml"
    assert main(["mesh", str(scene), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), *given]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if line.startswith("mass "))
    mass = 4 * 0.06 * 0.012 * 0.01 * 7850 + (0.5 if setting else 0.0)
    assert rows["mass"] == f"{mass:.6g} kg"


def test_three_gauges_do_not_tell_six_components(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = scene_path("base-sensor") / "plate-beams.toml"
    given = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--set"]
    few = 'body.plate.gauges=["top0","top1","top3"]'
    assert main(["calibrate", str(scene), *given, few]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert "the 3 signals tell 3 of 6 components; missing: " in said
    assert "Mz" in said
    assert not (tmp_path / "out" / "calibration.json").exists()
    kept = 'sensor.base.components=["Fz","Mx","My"]'
    assert main(["calibrate", str(scene), *given, few, "--set", kept]) == 0


def test_least_squares_of_measured_rows(tmp_path: Path) -> None:
    """Exact rows give sensitivity and offsets to round-off; noise of σ leaves σ in the signals."""
    random = np.random.default_rng(2)
    wrenches = random.standard_normal((400, 6)) * [200, 200, 500, 20, 20, 20]
    offsets = 1e-5 * np.arange(8)
    signals = wrenches @ STRAINS.T + offsets
    names = ["Fx [kN]", "Fy", "Fz [N]", "Mx [N m]", "My", "Mz [N mm]"]
    heads = columned(names, wrenches * [1e-3, 1, 1, 1, 1, 1e3])
    clean = heads | columned([f"{name} [mV/V]" for name in NAMES], 1e3 * signals)
    found = of_data(table(tmp_path / "a.csv", clean), CHANNELS, WRENCH, {})
    np.testing.assert_allclose(found.sensitivity, STRAINS, atol=1e-9 * np.abs(STRAINS).max())
    np.testing.assert_allclose(found.offsets, offsets, atol=1e-15)
    np.testing.assert_allclose(found.wrenches(signals), wrenches, atol=1e-8)
    noisy = heads | columned(NAMES, signals + 1e-7 * random.standard_normal(signals.shape))
    found = of_data(table(tmp_path / "b.csv", noisy), CHANNELS, WRENCH, {})
    assert found.residuals["signal_rms"] == pytest.approx([1e-7] * 8, rel=0.12)  # Three deviations of 393 freedoms.
    np.testing.assert_allclose(found.matrix @ STRAINS, np.eye(6), atol=5e-3 * 500 / 20)


def test_data_of_too_low_rank_name_what_is_missing(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    wrenches = random.standard_normal((50, 6))
    wrenches[:, 2] = 7.0  # A constant force is no excitation: it cannot be told from the offsets.
    columns = columned(WRENCH, wrenches) | columned(NAMES, wrenches @ STRAINS.T)
    with pytest.raises(InputError, match=r"span 5 of 6 components; missing: Fz$"):
        of_data(table(tmp_path / "a.csv", columns), CHANNELS, WRENCH, {})
    wrenches[:, 2] = 0.5 * wrenches[:, 3]
    columns = columned(WRENCH, wrenches) | columned(NAMES, wrenches @ STRAINS.T)
    with pytest.raises(InputError, match=r"span 5 of 6 components; missing: (Fz with -0\.5 Mx|Mx with -2 Fz)$"):
        of_data(table(tmp_path / "a.csv", columns), CHANNELS, WRENCH, {})
    with pytest.raises(InputError, match="span 2 of 6 components"):
        of_data(table(tmp_path / "a.csv", {k: v[:3] for k, v in columns.items()}), CHANNELS, WRENCH, {})


def test_bridges() -> None:
    """k/4 (ε₁ − ε₂ + ε₃ − ε₄): bending of two sides counts twice in a half bridge, and stretch not at all."""
    channels = {name: Channel(gauges=gauges) for name, gauges in
                {"q": ("top",), "h": ("top", "bottom"), "f": ("top", "bottom", "a", "b")}.items()}  # fmt: skip
    A = bridge_matrix(channels, ("top", "bottom", "a", "b"), 2.0)
    np.testing.assert_allclose(A @ [1e-4, -1e-4, 0, 0], [0.5e-4, 1e-4, 1e-4])
    np.testing.assert_allclose(A @ [1e-4, 1e-4, 1e-4, 1e-4], [0.5e-4, 0, 0])
    with pytest.raises(ValueError, match="wiring 'full' has 4 gauges, 2 given"):
        Channel(gauges=("a", "b"), wiring="full")
    with pytest.raises(ValueError, match="3 gauges given; a bridge has"):
        Channel(gauges=("a", "b", "c"))


def test_electronics_are_seeded_and_have_their_deviations() -> None:
    ideal, interval = np.zeros((20000, 40)), 1e-3
    noise = measured(ideal, interval, Sensor(body="a", noise=1e-6, seed=3))
    assert noise.std() == pytest.approx(1e-6, rel=0.01)
    assert np.array_equal(noise, measured(ideal, interval, Sensor(body="a", noise=1e-6, seed=3)))
    drift = measured(ideal, interval, Sensor(body="a", drift=1e-6))
    assert drift[999].std() == pytest.approx(1e-6, rel=0.35)  # Of 40 channels after one second: three deviations.
    steps = measured(ideal + 3.4e-9, interval, Sensor(body="a", resolution=1e-9))
    np.testing.assert_allclose(steps, 3e-9)


def test_wrenches_of_signals(tmp_path: Path) -> None:
    wrenches = np.random.default_rng(0).standard_normal((7, 6)) * 100
    signals = 1e6 * (wrenches @ STRAINS.T + 1e-6)
    columns = {"time [ms]": np.arange(7.0)} | columned([f"{name} [µV/V]" for name in NAMES], signals)
    found = infer(written(tmp_path), table(tmp_path / "s.csv", columns), None)
    assert found.samples == 7
    assert found.path == tmp_path / "s-wrench.csv"
    lines = found.path.read_text().splitlines()
    assert lines[0] == "time [s],Fx [N],Fy [N],Fz [N],Mx [N m],My [N m],Mz [N m]"
    rows = np.array([line.split(",") for line in lines[1:]], float)
    np.testing.assert_allclose(rows[:, 0], np.arange(7) * 1e-3)
    np.testing.assert_allclose(rows[:, 1:], wrenches, atol=1e-6)


HEAD = ",".join(NAMES)
ROW = ",".join(["1e-6"] * 8)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the table of signals is empty; its first row names columns top0, side0"),
        (HEAD, "has no row below the head"),
        (f"{HEAD}\n{ROW}\n1,2,3", "row 3 has 3 cells, the first row has 8; is it cut off"),
        (f"{HEAD}\n{ROW}\n{ROW.replace('1e-6', 'nan', 1)}", "row 3, column 1 holds 'nan', a finite number is needed"),
        (f"{HEAD}\n{ROW.replace('1e-6', 'x', 1)}", "row 2, column 1 holds 'x', a number is needed"),
        (f"{HEAD}\n{ROW.replace('1e-6', '', 1)}", "row 2, column 1 holds '', a number is needed"),
        (f"{HEAD.replace(',', ';')}\n{ROW.replace(',', ';')}", "is separated by semicolons; allowed: commas"),
        (f"{HEAD.replace('side3', 'side')}\n{ROW}", r"column 8 is 'side', did you mean 'side\d'"),
        (f"{HEAD.replace(',side3', '')}\n{ROW[:-5]}", "no column side3; the table of signals needs top0"),
        (f"{HEAD.replace('side3', 'top0')}\n{ROW}", "column 8: 'top0' is given twice"),
        (f"{HEAD.replace('side3', 'side3 [V]')}\n{ROW}", r"column 8: 'side3' is in 'V', allowed: V/V, mV/V"),
        (f"{HEAD}\n{ROW.replace('1e-6', '1e308', 1)}", "wrenches beyond the range of numbers"),
    ],
)
def test_wrong_tables_are_refused_and_nothing_is_written(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text(text)
    calibration = written(tmp_path)
    with pytest.raises(InputError, match=message):
        infer(calibration, tmp_path / "s.csv", tmp_path / "w.csv")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["c.json", "s.csv"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda raw: raw | {"kind": "other"}, "no calibration of version 1"),
        (lambda raw: raw | {"matrix": [[1.0]]}, "damaged: 6 components and 8 channels need a finite matrix"),
        (lambda raw: {k: v for k, v in raw.items() if k != "offsets"}, "damaged: KeyError at 'offsets'"),
        (lambda raw: [raw], "no calibration of version 1"),
    ],
)
def test_files_that_are_no_calibration_are_refused(change: Any, message: str, tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    with pytest.raises(InputError, match=message):
        read_calibration(path)
    path.write_text("{")
    with pytest.raises(InputError, match="no calibration"):
        read_calibration(path)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("sensor.base.body='disc'", "sensor.base.body: no body 'disc'"),
        ("sensor.base.force='push'", "sensor.base.force: no force 'push' of kind 'wrench'; the scene has wrench"),
        ("sensor.base.channel={a={gauges=['top9']}}", "sensor.base.channel.a.gauges: no 'top9' in body.plate.gauges"),
        ("component.plate.gauge.top0.quantity='stress'", "'top0' is no strain gauge; give it quantity"),
    ],
)
def test_wrong_sensors_are_refused(key: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = scene_path("base-sensor") / "plate-beams.toml"
    assert main(["calibrate", str(scene), "--db", str(tmp_path / "db"), "--set", key]) == 2
    assert message in capsys.readouterr().err
