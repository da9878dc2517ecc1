"""The rods of `exudyn_rods.py` in Exudyn's form for small motion, which is cheaper where nothing turns.

The same shapes and one rigid translation a rod are `ObjectGenericODE2` with constant mass and stiffness, and the same
spring is `ObjectContactCoordinate`. That object acts between single coordinates of two nodes: a reflection turns the
coordinates of a rod until the first of them is the mean displacement of the face that meets the other rod.
"""

import time

import numpy as np

from tests.benchmarks.exudyn_rods import GAP, Impact, Rod, Setup, _settings

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Mass, stiffness and a rigid velocity of 1 m/s along z, in the coordinates of a rod."""


def small(rod: Rod, setup: Setup) -> tuple[Matrices, Matrices]:
    """Return the rod that strikes, by its front, and the one that is struck, by its back."""
    assert rod.modal.shapes is not None
    size = rod.M.shape[0]
    rigid = np.zeros(size)
    rigid[2::3] = 1.0
    rigid /= np.sqrt(rigid @ (rod.M @ rigid))
    shapes = np.column_stack([rigid, rod.modal.shapes.reshape(size, -1)[:, : setup.coordinates]])
    back, front = (_turned(shapes, rod, nodes, weights) for nodes, weights in rod.faces)
    return front, back


def _turned(shapes: np.ndarray, rod: Rod, nodes: np.ndarray, weights: np.ndarray) -> Matrices:
    """Return a rod in coordinates whose first is the mean displacement of a face along z [m]."""
    row = np.zeros(len(shapes))
    np.add.at(row, 3 * nodes + 2, weights)
    w = row @ shapes
    length = np.linalg.norm(w)
    v = w / length
    v[0] += np.copysign(1.0, v[0])
    reflection = np.eye(len(w)) - 2 * np.outer(v, v) / (v @ v)
    reflection[0] *= np.sign(reflection[0] @ w)
    T = reflection.T.copy()
    T[:, 0] /= length
    velocity = np.zeros(len(w))
    velocity[0] = 1 / shapes[2, 0]
    basis = shapes @ T
    return basis.T @ (rod.M @ basis), basis.T @ (rod.K @ basis), np.linalg.solve(T, velocity)


def strike_small(bodies: tuple[Matrices, Matrices], setup: Setup, *, speed: float, duration: float) -> Impact:
    """Let the first rod hit the second, at rest, at `speed` [m/s] along z; the least CPU time of five runs counts.

    Raises:
        ValueError: Exudyn's solver gave up.
    """
    import exudyn as exu
    from exudyn import itemInterface as items

    system, markers, sensors = exu.SystemContainer().AddSystem(), [], []
    for (mass, stiffness, rigid), v in zip(bodies, (speed, 0.0), strict=True):
        zero = np.zeros(len(rigid))
        node = system.AddNode(
            items.NodeGenericODE2(
                numberOfODE2Coordinates=len(rigid), referenceCoordinates=zero, initialCoordinates=zero,
                initialCoordinates_t=v * rigid,
            )
        )  # fmt: skip
        system.AddObject(items.ObjectGenericODE2(nodeNumbers=[node], massMatrix=mass, stiffnessMatrix=stiffness))
        markers.append(system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)))
        kind = exu.OutputVariableType.Coordinates
        sensors.append(system.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)))
    state = system.AddNode(items.NodeGenericData(initialCoordinates=[GAP], numberOfDataCoordinates=1))
    system.AddObject(
        items.ObjectContactCoordinate(
            markerNumbers=markers, nodeNumber=state, contactStiffness=setup.stiffness, contactDamping=0.0, offset=GAP
        )
    )
    system.Assemble()
    seconds = []
    for _ in range(5):
        start = time.process_time()
        if not system.SolveDynamic(_settings(exu, setup.step, duration)):
            raise ValueError(f"Exudyn did not finish with {setup}")
        seconds.append(time.process_time() - start)
    striker, struck = (np.array(system.GetSensorStoredData(sensor)) for sensor in sensors)
    force = setup.stiffness * np.maximum(striker[:, 1] - struck[:, 1] - GAP, 0.0)
    return Impact(striker[:, 0], force, min(seconds))
