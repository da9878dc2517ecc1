"""A rod strikes an equal rod in Exudyn, with our mesh, our matrices and, if wanted, our shapes.

Exudyn is Gerstmayr's multibody code (Multibody System Dynamics 60, 2024); its flexible bodies are reduced bodies in a
floating frame (Zwölfer & Gerstmayr, Acta Mechanica 231, 2020). Contact objects take markers that are means over mesh
nodes, so an end face meets an end face as two spheres on one line: one penalty spring, its force on each face spread by
the same weights as our row of kind `patch`.
"""

import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.interfaces.points import surface_weights
from gudgeon.pipeline.stages.job import Job

RADIUS = 5e-3
"""Of the spheres [m]; their centres are the faces' mean points, so that body two stands two radii further off."""
GAP = 1e-9
"""Between the spheres at the start [m]: flown through in a thousandth of a step."""
SPECTRAL_RADIUS = 0.9
"""Of the generalised-α scheme."""
RIGID_MODES = 6


@dataclass(frozen=True)
class Rod:
    """One rod, before reduction and after ours."""

    mesh: MeshRecord
    modal: ModalRecord
    K: sparse.csr_matrix
    M: sparse.csr_matrix
    faces: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    """Nodes and weights of sum 1 of the face at the back and of the one in front."""


@dataclass(frozen=True)
class Setup:
    """What Exudyn is given."""

    basis: Literal["eigenmodes", "hurty-craig-bampton", "ours"]
    coordinates: int
    """Shapes per rod, beside the frame's rigid motions."""
    stiffness: float
    """Of the contact [N/m]."""
    damping: float = 0.0
    """Of the contact [N s/m]."""
    step: float = 1e-6
    """[s]"""


@dataclass(frozen=True)
class Impact:
    """What a run found."""

    times: np.ndarray
    """[s], (s,)"""
    force: np.ndarray
    """[N], (s,)"""
    cpu_seconds: float
    """Of the time integration alone, least of the repeats."""


def rod_of(job: Job, component: str, *, back: str, front: str) -> Rod:
    """Read mesh and modes of a component whose stages have run, and assemble it.

    Args:
        back: Interface that is struck.
        front: Interface that strikes.
    """
    keys, settings = job.components()[component], job.scene.component[component]
    mesh, modal = job.store.get(keys["mesh"].key, "mesh"), job.store.get(keys["modes"].key, "modes")
    model = build_model(mesh, settings.material, settings.supports, component, settings.geometry)
    faces = []
    for name in (back, front):
        nodes, shares, _ = surface_weights(mesh, mesh.surfaces[settings.interface[name].surface])
        faces.append((nodes, shares / shares.sum()))
    return Rod(mesh, modal, model.K, model.M, (faces[0], faces[1]))


def reduced(rod: Rod, setup: Setup) -> Any:
    """Return Exudyn's reduced body; many runs may use it."""
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface

    fem = FEMinterface()
    fem.nodes = {"Position": np.array(rod.mesh.nodes)}
    fem.massMatrix, fem.stiffnessMatrix = rod.M, rod.K
    if setup.basis == "eigenmodes":
        fem.ComputeEigenmodes(setup.coordinates, excludeRigidBodyModes=RIGID_MODES)
    elif setup.basis == "hurty-craig-bampton":
        # Two faces have twelve motions; those of the first are left out, they are the body's rigid ones.
        boundaries = [[int(node) for node in nodes] for nodes, _ in rod.faces]
        eigenmodes = setup.coordinates - RIGID_MODES
        fem.ComputeHurtyCraigBamptonModes(boundaries, eigenmodes, computationMode=HCBstaticModeSelection.RBE2)
    else:
        assert rod.modal.shapes is not None
        shapes = rod.modal.shapes.reshape(-1, rod.modal.shapes.shape[2])[:, : setup.coordinates]
        fem.modeBasis = {"matrix": np.ascontiguousarray(shapes), "type": "NormalModes"}
    body = ObjectFFRFreducedOrderInterface(fem)
    if body.nModes != setup.coordinates:
        raise ValueError(f"basis '{setup.basis}' has {body.nModes} shapes, asked for were {setup.coordinates}")
    return body


def strike(rod: Rod, body: Any, setup: Setup, *, speed: float, duration: float, repeats: int = 1) -> Impact:
    """Let one rod hit another, equal one at rest, at `speed` [m/s] along z.

    Raises:
        ValueError: Exudyn's solver gave up.
    """
    import exudyn as exu

    system = exu.SystemContainer().AddSystem()
    length = float(np.ptp(rod.mesh.nodes[:, 2]))
    one = body.AddObjectFFRFreducedOrder(system, positionRef=[0, 0, 0], initialVelocity=[0, 0, speed])
    two = body.AddObjectFFRFreducedOrder(system, positionRef=[0, 0, length + 2 * RADIUS + GAP])
    force = _contact(system, (one, two), rod, setup)
    system.Assemble()
    settings = _settings(exu, setup.step, duration)
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        if not system.SolveDynamic(settings):
            raise ValueError(f"Exudyn did not finish with {setup}")
        seconds.append(time.process_time() - start)
    found = np.array(system.GetSensorStoredData(force))
    return Impact(found[:, 0], np.linalg.norm(found[:, 1:4], axis=1), min(seconds))


def _contact(system: Any, bodies: tuple[Any, Any], rod: Rod, setup: Setup) -> Any:
    """Put the contact between front of the first body and back of the second; returns the sensor of its force."""
    import exudyn as exu
    from exudyn import itemInterface as items

    markers = [
        system.AddMarker(
            items.MarkerSuperElementPosition(
                bodyNumber=body["oFFRFreducedOrder"], meshNodeNumbers=[int(n) for n in nodes], weightingFactors=weights
            )
        )
        for body, (nodes, weights) in zip(bodies, rod.faces[::-1], strict=True)
    ]
    state = system.AddNode(items.NodeGenericData(initialCoordinates=[GAP, 0, 0, 0], numberOfDataCoordinates=4))
    spheres = items.ObjectContactSphereSphere(
        markerNumbers=markers, nodeNumber=state, spheresRadii=[RADIUS, RADIUS],
        contactStiffness=setup.stiffness, contactDamping=setup.damping,
    )  # fmt: skip
    return system.AddSensor(
        items.SensorObject(
            objectNumber=system.AddObject(spheres), storeInternal=True, outputVariableType=exu.OutputVariableType.Force
        )
    )


def _settings(exu: Any, step: float, duration: float) -> Any:
    """Return settings: a fixed step, no files, and no reduction of the step at contact, which ends the run."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = duration, round(duration / step)
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
    integration.newton.useModifiedNewton = True
    integration.discontinuous.iterationTolerance = 1.0
    integration.discontinuous.useRecommendedStepSize = False
    integration.discontinuous.maxIterations = 5
    settings.solution.sensors.writePeriod = step
    settings.solution.file.write = False
    return settings
