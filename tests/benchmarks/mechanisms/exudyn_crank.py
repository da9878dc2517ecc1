"""The elastic slider-crank in Exudyn: `python exudyn_crank.py CASE.json` prints modal coordinates and CPU times.

Runs by an interpreter with the extra `peers`; it imports nothing of Gudgeon but the exported script of the rod, an
`ObjectFFRFreducedOrder` of the same shapes on spherical joints. The crank is one coordinate of such an inertia that the
rod does not change its speed. The case has the script, sizes, masses, speed, duration, samples and steps.
"""

import json
import runpy
import sys
import time

import exudyn as exu
import numpy as np
from exudyn import itemInterface as items

HEAVY = 1e6
"""Inertia of the crank [kg m²]: it keeps its speed to 1e-8."""
AXES = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
"""Of the crank as columns: it turns about y, from z to x."""


def model(case, script, body):
    """Return a container, its system, and the sensor of the rod's modal coordinates."""
    container = exu.SystemContainer()
    mbs, length, speed = container.AddSystem(), case["length"], case["speed"]
    turn = mbs.AddNode(items.Node1D(referenceCoordinates=[0.0], initialVelocities=[speed]))
    crank = mbs.AddObject(items.ObjectRotationalMass1D(inertia=HEAVY, nodeNumber=turn, referenceRotation=AXES))
    rod = body.AddObjectFFRFreducedOrder(
        mbs, positionRef=[0, 0, case["crank"]], initialVelocity=[speed * case["crank"], 0, 0],
        initialAngularVelocity=[0, -speed * case["crank"] / length, 0],
    )  # fmt: skip
    place = mbs.AddNode(items.NodePoint(referenceCoordinates=[0, 0, case["crank"] + length]))
    slider = mbs.AddObject(items.ObjectMassPoint(mass=case["slider"], nodeNumber=place))
    ends = (crank, [case["crank"], 0, 0], case["big"]), (slider, [0, 0, 0], case["small"])
    for owner, at, interface in ends:
        own = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=owner, localPosition=at))
        pair = [own, script["mean_marker"](mbs, rod, interface)]
        mbs.AddObject(items.ObjectJointSpherical(markerNumbers=pair, constrainedAxes=[1, 1, 1]))
    ground = mbs.AddNode(items.NodePointGround())
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for axis in (0, 1):
        own = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=place, coordinate=axis))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[fixed, own]))
    sensor = mbs.AddSensor(
        items.SensorNode(
            nodeNumber=rod["nGenericODE2"], storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates
        )
    )
    mbs.Assemble()
    return container, mbs, sensor


def run(case, script, body, steps):
    """Return the modal coordinates at the samples, (s, m), and the CPU time of the steps [s]."""
    _, mbs, sensor = model(case, script, body)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps * case["samples"]
    settings.timeIntegration.endTime = case["duration"]
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-8
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = case["duration"] / case["samples"]
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    settings.show.computationTime = False
    begin = time.process_time()
    if not mbs.SolveDynamic(settings):
        raise ValueError("Exudyn did not finish")
    seconds = time.process_time() - begin
    return np.array(mbs.GetSensorStoredData(sensor))[1:, 1:], seconds


def main(path):
    with open(path) as file:
        case = json.load(file)
    script = runpy.run_path(case["script"])
    body = script["reduced"]()
    for steps in case["steps"]:
        found, seconds = run(case, script, body, steps)
        print(json.dumps([steps, found.tolist(), seconds]))


if __name__ == "__main__":
    main(sys.argv[1])
