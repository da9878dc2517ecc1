"""Superelements of other programs whose matrices have rows of fixed-interface modes."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy import linalg
from scipy.io import netcdf_file

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from tests.pipeline.geometry import matrix_files as files

ROUND_OFF = 1e-9
"""Relative difference of frequencies to a dense eigensolution of the same matrices."""
TEN_DIGITS = 1e-7
"""The same of matrices that a file has with ten digits."""
TURN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Directions 1, 2, 3 of a node as columns: along z, −x and −y."""


class Reduced(NamedTuple):
    """A Craig-Bampton reduction: boundary nodes, three directions each, then modes."""

    K: np.ndarray
    M: np.ndarray
    points: np.ndarray
    """Boundary nodes [m], (n, 3)."""
    whole: Any
    """The model that is reduced."""
    boundary: np.ndarray
    """Its nodes at the boundary, (n,)."""

    @property
    def omega(self) -> np.ndarray:
        """Elastic ω [rad/s], ascending."""
        return np.sqrt(linalg.eigh(self.K, self.M, eigvals_only=True)[6:])


@pytest.fixture(scope="module")
def reduced() -> Reduced:
    mesh, model = files.block()
    z, size = mesh.nodes[:, 2], files.SIZE[2]
    ends = np.flatnonzero((np.abs(z - size / 2) > size / 2 - 1e-9) & (np.abs(np.abs(mesh.nodes[:, 0]) - 0.015) < 1e-9))
    b = (3 * ends[:, None] + np.arange(3)).ravel()
    i = np.setdiff1d(np.arange(model.K.shape[0]), b)
    K, M = model.K.toarray(), model.M.toarray()
    Phi = linalg.eigh(K[np.ix_(i, i)], M[np.ix_(i, i)], subset_by_index=(0, 7))[1]
    T = np.zeros((len(K), len(b) + 8))
    T[b, : len(b)] = np.eye(len(b))
    T[i, : len(b)] = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    T[i, len(b) :] = Phi
    A, B = (T.T @ matrix @ T for matrix in (K, M))
    return Reduced(0.5 * (A + A.T), 0.5 * (B + B.T), mesh.nodes[ends], model, ends)


def output4(path: Path, matrices: dict[str, np.ndarray]) -> Path:
    """Write matrices as text of OUTPUT4 with 17 digits, column by column."""
    lines = []
    for name, A in matrices.items():
        lines.append(f"{len(A):8d}{len(A):8d}{6:8d}{2:8d}{name:8s}1P,3E23.16")
        for column, values in enumerate(A.T, 1):
            lines.append(f"{column:8d}{1:8d}{len(A):8d}")
            lines += ["".join(f"{v:23.16E}" for v in values[k : k + 3]) for k in range(0, len(A), 3)]
        lines += [f"{len(A) + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    path.write_text("\n".join(lines) + "\n")
    return path


def dmig(path: Path, matrices: dict[str, np.ndarray], rows: list[tuple[int, int]]) -> Path:
    """Write lower triangles as DMIG with ten digits, of rows by point and component."""
    lines = []
    for name, A in matrices.items():
        lines.append(f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}")
        for column, (label, component) in enumerate(rows):
            lines.append(f"DMIG*   {name:8s}        {label:16d}{component:16d}")
            for row in range(column, len(rows)):
                value = f"{A[row, column]:.9E}".replace("E", "D")
                lines.append(f"*       {rows[row][0]:16d}{rows[row][1]:16d}{value:>16s}")
    path.write_text("\n".join(lines) + "\n")
    return path


def bulk(path: Path, points: np.ndarray, labels: np.ndarray, *extra: str, cd: str = "") -> str:
    cards = [f"GRID,{label},,{x!r},{y!r},{z!r},{cd}" for label, (x, y, z) in zip(labels, points.tolist(), strict=True)]
    path.write_text("\n".join([*cards, *extra, "ENDDATA"]) + "\n")
    return str(path)


def frequencies(**given: Any) -> np.ndarray:
    mesh = Matrices(kind="matrices", **given).build(None)
    model = build_model(mesh, None, (), "component.part")
    assert model.properties.mass == pytest.approx(7850 * np.prod(files.SIZE), rel=1e-6)
    return normal_modes(model, 10).angular_frequencies


def test_modal_rows_follow_the_boundary(tmp_path: Path, reduced: Reduced) -> None:
    labels = 100 + 11 * np.arange(len(reduced.points))
    matrices = output4(tmp_path / "se.op4", {"KXX": reduced.K, "MXX": reduced.M})
    sets = [f"ASET1,123,{label}" for label in labels] + ["SPOINT,9001,THRU,9008", "QSET1,0,9001,THRU,9008"]
    model = bulk(tmp_path / "se.bdf", reduced.points, labels, *sets)
    omega = frequencies(stiffness=str(matrices), model=model)
    np.testing.assert_allclose(omega, reduced.omega[:10], rtol=ROUND_OFF)


def permuted(reduced: Reduced, order: np.ndarray) -> dict[str, np.ndarray]:
    return {"KXX": reduced.K[np.ix_(order, order)], "MXX": reduced.M[np.ix_(order, order)]}


@pytest.mark.parametrize("cards", ["spoint", "extrn", "bset", "other grids", "dofs", "grid of modes"])
def test_orders_of_rows(tmp_path: Path, reduced: Reduced, cards: str) -> None:
    """Modes before the boundary by their numbers, boundary nodes as EXTRN has them, sets of several kinds, other points
    beside them, a file of rows, and modes as components of a grid point."""
    n, points = len(reduced.points), reduced.points
    labels = 100 + np.arange(n)
    order, more, extra = np.arange(3 * n + 8), {}, ["SPOINT,11,THRU,18"]
    if cards == "extrn":
        back = np.arange(n)[::-1]
        order = np.concatenate(
            [[3 * n + 7, 3 * n + 6], (3 * back[:, None] + np.arange(3)).ravel(), 3 * n + np.arange(6)]
        )
        fields = ["18,0", "17,0", *(f"{labels[k]},123" for k in back), *(f"{11 + k},0" for k in range(6))]
        extra.append("EXTRN," + "\n,".join(",".join(fields[k : k + 4]) for k in range(0, len(fields), 4)))
    elif cards == "grid of modes":
        extra = ["GRID,900,,9.,9.,9.", "GRID,901,,9.,9.,9.", "QSET1,123456,900", "QSET,901,12"]
        extra.append("\n".join(f"ASET,{label},123" for label in labels))
    else:
        order = np.concatenate([3 * n + np.arange(8), np.arange(3 * n)])
    if cards in ("bset", "other grids"):
        extra += ["QSET1,0,11,THRU,18", "SUPORT,100,123", f"BSET1,123,101,THRU,{100 + n // 2}"]
        extra += [f"CSET,{label},123" for label in labels[n // 2 + 1 :]]
    if cards == "other grids":
        extra += ["GRID,7,,5.,5.,5.", "CTETRA,1,1,7,100,101,102"]
    if cards == "dofs":
        rows = [f"{11 + k}.1" for k in range(8)] + [f"{label}.{d}" for label in labels for d in (1, 2, 3)]
        (tmp_path / "se.dof").write_text("\n".join(rows))
        more = {"dofs": str(tmp_path / "se.dof")}
    model = bulk(tmp_path / "se.bdf", points, labels, *extra)
    matrices = output4(tmp_path / "se.op4", permuted(reduced, order))
    omega = frequencies(stiffness=str(matrices), model=model, **more)
    np.testing.assert_allclose(omega, reduced.omega[:10], rtol=ROUND_OFF)


def test_turned_points_and_units(tmp_path: Path, reduced: Reduced) -> None:
    """Rows along CD of the points, in mm, t, s."""
    n = len(reduced.points)
    T = linalg.block_diag(*[TURN.T] * n, np.eye(8))
    K, M = (T @ A @ T.T * 1e-3 for A in (reduced.K, reduced.M))
    modal = np.where(np.arange(len(K)) < 3 * n, 1.0, 1e3)
    matrices = output4(tmp_path / "se.op4", {"KXX": K * np.outer(modal, modal), "MXX": M * np.outer(modal, modal)})
    system = "CORD2R,5,,0.,0.,0.,0.,-1.,0.\n,0.,0.,1."
    labels = 1 + np.arange(n)
    model = bulk(tmp_path / "se.bdf", 1e3 * reduced.points, labels, system, "SPOINT,11001,THRU,11008", cd="5")
    omega = frequencies(stiffness=str(matrices), model=model, unit=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(omega, reduced.omega[:10], rtol=ROUND_OFF)


def test_dmig_with_scalar_points(tmp_path: Path, reduced: Reduced) -> None:
    labels = 1 + np.arange(len(reduced.points))
    rows = [(int(label), d) for label in labels for d in (1, 2, 3)] + [(900001 + k, 0) for k in range(8)]
    matrices = dmig(tmp_path / "se.pch", {"KAAX": reduced.K, "MAAX": reduced.M}, rows)
    model = bulk(tmp_path / "se.bdf", reduced.points, labels)
    omega = frequencies(stiffness=str(matrices), model=model)
    np.testing.assert_allclose(omega, reduced.omega[:10], rtol=TEN_DIGITS)


def exodus(path: Path, reduced: Reduced) -> Path:
    """Write matrices as Sierra/SD does, modes before the boundary."""
    n = len(reduced.points)
    order = np.concatenate([3 * n + np.arange(8), np.arange(3 * n)])
    labels = 7 * np.arange(1, n + 1)
    with netcdf_file(str(path), "w", version=2) as file:
        for name, size in (("n", n), ("N", 3 * n + 8), ("two", 2)):
            file.createDimension(name, size)
        boundary = np.column_stack([np.repeat(labels, 3), np.tile([1, 2, 3], n)])
        for name, kind, shape, values in (
            ("coordx", "d", ("n",), reduced.points[:, 0]), ("coordy", "d", ("n",), reduced.points[:, 1]),
            ("coordz", "d", ("n",), reduced.points[:, 2]), ("node_num_map", "i", ("n",), labels),
            ("Kr", "d", ("N", "N"), permuted(reduced, order)["KXX"]),
            ("Mr", "d", ("N", "N"), permuted(reduced, order)["MXX"]),
            ("cbmap", "i", ("N", "two"), np.concatenate([np.zeros((8, 2)), boundary])),
        ):  # fmt: skip
            file.createVariable(name, kind, shape)[:] = values
    return path


def test_exodus_with_a_map_of_rows(tmp_path: Path, reduced: Reduced) -> None:
    path = exodus(tmp_path / "se.nc4", reduced)
    np.testing.assert_allclose(frequencies(stiffness=str(path)), reduced.omega[:10], rtol=ROUND_OFF)


def substructure(path: Path, reduced: Reduced, angles: tuple[float, ...] = (0.0, 0.0, 0.0), **header: int) -> str:
    """Write a .sub as Ansys does: records of words, rows of K and M in turn, two virtual nodes."""
    n, words = len(reduced.points), bytearray()

    def record(values: Any, kind: str) -> int:
        start, content = len(words) // 4, np.asarray(values, kind).tobytes()
        words.extend(struct.pack("<iI", len(content) // 4, 0 if kind == "<f8" else 0x80000000))
        words.extend(content + struct.pack("<i", len(content) // 4))
        return start

    numbers = np.zeros(60, int)
    labels = 637 + np.arange(n)
    rows = [3 * (label - 1) + d for label in labels for d in (1, 2, 3)] + list(range(100, 108))
    for final in (False, True):
        words.clear()
        record([8, -1, *[0] * 98], "<i4")
        record(numbers, "<i4")
        at = {30: record([1, 2, 3], "<i4"), 31: record(rows, "<i4"), 34: record([*labels, 40001, 40002, 40003], "<i4")}
        for k, point in enumerate([*reduced.points, *np.ones((3, 3))]):
            at.setdefault(35, record([*point, *(angles if k < n else (0.0, 0.0, 0.0))], "<f8"))
        for A, B in zip(reduced.K, reduced.M, strict=True):
            at.setdefault(21, record(A, "<f8"))
            record(B, "<f8")
        counts = {0: 8, 1: len(rows), 2: 2, 4: 3, 8: n + 3, 10: 1, 11: 1, 43: 8, 50: 3}
        for key, value in {**counts, **at, **{int(k[1:]): v for k, v in header.items()}}.items():
            numbers[key] = value
        assert final or numbers[21]
    path.write_bytes(bytes(words))
    return str(path)


def test_substructures_of_ansys(tmp_path: Path, reduced: Reduced) -> None:
    path = substructure(tmp_path / "se.sub", reduced)
    np.testing.assert_allclose(frequencies(stiffness=path), reduced.omega[:10], rtol=ROUND_OFF)


def test_turned_nodes_of_a_substructure(tmp_path: Path, reduced: Reduced) -> None:
    """Angles of 90° about z, then of −90° about the new x."""
    turn = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    T = linalg.block_diag(*[turn.T] * len(reduced.points), np.eye(8))
    turned = reduced._replace(K=T @ reduced.K @ T.T, M=T @ reduced.M @ T.T)
    path = substructure(tmp_path / "se.sub", turned, (90.0, -90.0, 0.0))
    np.testing.assert_allclose(frequencies(stiffness=path), reduced.omega[:10], rtol=ROUND_OFF)


@pytest.mark.parametrize(("header", "message"), [
    ({"h0": 9}, "its matrices are sparse"), ({"h9": 1}, "not symmetric"), ({"h11": 0}, "it has no mass"),
    ({"h20": 1}, "SETRAN"), ({"h43": 7}, "8 of 68 rows belong to no node, of 7 modes"), ({"h21": 3}, "a record of"),
])  # fmt: skip
def test_what_a_substructure_may_not_have(
    tmp_path: Path, reduced: Reduced, header: dict[str, int], message: str
) -> None:
    path = substructure(tmp_path / "se.sub", reduced, **header)
    with pytest.raises(InputError, match=message):
        Matrices(kind="matrices", stiffness=path).build(None)


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def noisy(data: bytes) -> bytes:
    return data[:500] + bytes(255 - byte for byte in data[500:700]) + data[700:]


@pytest.mark.parametrize("damage", [cut, noisy, lambda data: b""])
def test_a_damaged_substructure_ends_in_one_line(
    tmp_path: Path, reduced: Reduced, damage: Callable[[bytes], bytes]
) -> None:
    path = Path(substructure(tmp_path / "se.sub", reduced))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=r"se\.sub") as error:
        Matrices(kind="matrices", stiffness=str(path)).build(None)
    assert "\n" not in str(error.value)


def test_compliance_at_the_boundary_is_that_of_the_whole(tmp_path: Path, reduced: Reduced) -> None:
    """A body that supports hold at boundary nodes: modes and R together are exact statics at others."""
    labels = 1 + np.arange(len(reduced.points))
    low = " ".join(str(k) for k in labels[reduced.points[:, 2] < 0.01]).replace(" ", ",")
    high = " ".join(str(k) for k in labels[reduced.points[:, 2] > 0.01]).replace(" ", ",")
    sets = [
        "SPOINT,9001,THRU,9008",
        *(f"SET1,{k}," + "\n,".join(part) for k, part in ((1, split(low)), (2, split(high)))),
    ]
    matrices = output4(tmp_path / "se.op4", {"KXX": reduced.K, "MXX": reduced.M})
    geometry = Matrices(
        kind="matrices", stiffness=str(matrices), model=bulk(tmp_path / "se.bdf", reduced.points, labels, *sets)
    )
    component = Component(
        geometry=geometry, modes={"normal_count": 5}, supports=("set1",),
        interface={"top": {"surface": "set2", "kind": "mean"},
                   "tip": {"surface": f"node_{labels[-1]}", "kind": "mean"}},
    )  # fmt: skip
    record = reduce_component(geometry.build(None), "key", component, "part")
    b = (3 * reduced.boundary[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(len(reduced.whole.held)), b[np.repeat(reduced.points[:, 2] < 0.01, 3)])
    load = np.zeros((len(reduced.whole.held), 3))
    load[b[-3:]] = np.eye(3)
    K = reduced.whole.K.toarray()
    exact = np.linalg.solve(K[np.ix_(free, free)], load[free]).T @ load[free]
    start, stop = record.interface_rows["tip"]
    rows, R = record.loads["tip"].rows, record.residual_flexibility
    assert R is not None
    compliance = (rows / record.angular_frequencies**2) @ rows.T + R[start:stop, start:stop]
    np.testing.assert_allclose(compliance, exact, rtol=1e-8, atol=1e-8 * exact.max())
    assert record.quality["rigid_motions"] == 0


def split(numbers: str) -> list[str]:
    words = numbers.split(",")
    return [",".join(words[k : k + 7]) for k in range(0, len(words), 7)]
