"""Andrews' squeezing mechanism in Exudyn, in its plane: `python exudyn_model.py CASE.json` prints angles and CPU times.

Runs by an interpreter with the extra `peers`; it imports nothing of Gudgeon. The case has the bodies' masses, inertias
and places, the points of pins on both bodies, spring and torque, duration and steps.
"""

import json
import sys
import time

import exudyn as exu
import numpy as np
from exudyn import itemInterface as items


def system_of(case):
    """Return a system with the crank's node and the container that owns it."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground, nodes, bodies = system.AddObject(items.ObjectGround()), {}, {None: None}
    bodies[None] = ground
    for name, body in case["bodies"].items():
        x, y = body["place"]
        nodes[name] = system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x, y, 0.0]))
        bodies[name] = system.AddObject(
            items.ObjectRigidBody2D(mass=body["mass"], inertia=body["inertia"], nodeNumber=nodes[name])
        )

    def marker(name, point):
        place = [*point, 0.0]
        return system.AddMarker(items.MarkerBodyPosition(bodyNumber=bodies[name], localPosition=place))

    for one, at, other, there in case["pins"]:
        pair = [marker(one, at), marker(other, there)]
        system.AddObject(items.ObjectJointRevolute2D(markerNumbers=pair))
    one, at, other, there, stiffness, length = case["spring"]
    pair = [marker(other, there), marker(one, at)]
    system.AddObject(items.ObjectConnectorSpringDamper(markerNumbers=pair, stiffness=stiffness, referenceLength=length))
    crank, torque = case["torque"]
    own = system.AddMarker(items.MarkerBodyRigid(bodyNumber=bodies[crank]))
    system.AddLoad(items.Torque(markerNumber=own, loadVector=[0.0, 0.0, torque]))
    system.Assemble()
    return container, system, nodes[crank]


def run(case, step):
    """Return the crank's angle at the end [rad] and the CPU time of the steps [s]."""
    _, system, crank = system_of(case)
    settings = exu.SimulationSettings()
    count = round(case["duration"] / step)
    settings.timeIntegration.numberOfSteps = count
    settings.timeIntegration.endTime = case["duration"]
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-10
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = case["duration"]
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    settings.show.computationTime = False
    begin = time.process_time()
    system.SolveDynamic(settings)
    seconds = time.process_time() - begin
    return float(system.GetNodeOutput(crank, exu.OutputVariableType.Coordinates)[2]), seconds


def main(path):
    with open(path) as file:
        case = json.load(file)
    found = []
    for step in case["steps"]:
        both = [run(case, step) for _ in range(case["repeats"])]
        found.append([step, both[0][0], float(np.min([seconds for _, seconds in both]))])
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
