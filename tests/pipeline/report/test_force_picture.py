"""`report-force.png`: of each contact the reference, full FE among them, and the run of the error budget."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.report.page import force_picture


def test_two_curves_for_each_contact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times, drawn = np.linspace(0.0, 1e-3, 401)[1:], list[Any]()
    pulse = np.sin(np.pi * times / 1e-3)[:, None] * np.array([0.0, 3.0, 4.0])
    runs = [
        SimpleNamespace(
            times=times, contacts={name: SimpleNamespace(force=scale * pulse) for name in ("thrust", "anti")}
        )
        for scale in (10.0, 9.0)
    ]  # fmt: skip
    scene = SimpleNamespace(
        report=SimpleNamespace(window=0.0, until=None), contact={"thrust": None, "anti": None},
        run=SimpleNamespace(duration=1e-3),
    )  # fmt: skip
    job: Any = SimpleNamespace(name="piston", scene=scene)
    save = force_picture.save

    def kept(figure: Any, path: Path) -> None:
        drawn.append([[line.get_xydata() for line in axes.lines] for axes in figure.axes])
        drawn.append([text.get_text() for text in figure.axes[0].get_legend().get_texts()])
        save(figure, path)

    monkeypatch.setattr(force_picture, "save", kept)
    path = tmp_path / "report-force.png"
    force_picture.draw_forces(job, (runs[0], runs[1]), ("full FE, 1 µs", "30 modes"), path)  # type: ignore[arg-type]
    curves, legend = drawn
    assert legend == ["reference: full FE, 1 µs", "30 modes"]
    assert [len(lines) for lines in curves] == [2, 2]
    for reference, own in curves:
        assert reference[:, 1].max() == pytest.approx(50.0, rel=1e-3)
        np.testing.assert_allclose(own[:, 1], 0.9 * reference[:, 1], rtol=1e-9)
        assert own[-1, 0] == pytest.approx(1.0)
    assert path.stat().st_size > 10_000
