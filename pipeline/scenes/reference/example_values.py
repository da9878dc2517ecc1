"""Examples of keys that no shipped scene has."""

from typing import Any

BY_NAME: dict[str, Any] = {
    "body": "part", "interface": "foot", "against": "frame", "against_interface": "seat", "joint": "hinge",
    "at": [0.0, 0.0, 0.01], "against_at": [0.0, 0.0, 0.05], "point": [0.0, 0.0, 0.01], "origin": [0.0, 0.0, 0.0],
    "axis": [0.0, 0.0, 1.0], "against_axis": [1.0, 0.0, 0.0], "direction": [0.0, 0.0, 1.0], "normal": [0.0, 0.0, 1.0],
    "table": "values.csv", "surface": "bottom", "radius": 0.01, "length": 0.1, "unit": 1e-3, "thickness": 2e-3,
    "shear_coefficient": 0.85, "lx": 0.06, "ly": 0.04, "held": True, "area": 2e-4, "mass": 0.2, "offset": 1e-4,
    "modulus": 1.1e11, "interpolation": "linear", "state": "plane-strain", "share": 0.5, "factor": 10.0,
}  # fmt: skip
"""By the name of the key, where the table has none of its own."""
BY_TABLE: dict[str, dict[str, Any]] = {
    "Axis": {"values": [0.0, 1e-4, 3e-4, 9e-4]},
    "Body": {"velocity_at": [0.0, 0.0, 0.02]},
    "Bushing": {
        "stiffness": [1e6, 1e6, 2e6], "rotational_stiffness": [100.0, 100.0, 50.0], "damping": [10.0, 10.0, 20.0],
        "rotational_damping": [0.1, 0.1, 0.05], "coupling": [[0.0, 1e3, 0.0], [-1e3, 0.0, 0.0], [0.0, 0.0, 0.0]],
        "coupling_damping": [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    },
    "CadPart": {"path": "bracket.step", "unit": 1e-3, "solids": [1, 2], "sizes": {"foot": 1e-3}},
    "Conductor": {"charge": 1e-9},
    "Damping": {
        "ratios": [0.01, 0.01, 0.02], "table": "damping.csv", "values": [[100.0, 0.01], [5000.0, 0.03]],
        "alpha": 5.0, "beta": 1e-7,
    },
    "Distance": {"length": 0.1},
    "Driven": {"values": [[0.0, 0.0], [0.1, 0.2], [0.2, 0.2]], "expression": "0.2*sin(2*pi*50*t)",
               "motion": "angle"},
    "Electrostatic": {
        "field": "field.toml", "record": "9f2c41d07ab35e68", "potentials": {"upper": 5.0}, "start": [0.0, 0.0, 1e-6],
        "turn": [0.0, 0.0, 90.0], "off_axis_length": 1e-9, "off_axis_angle": 1e-4,
    },
    "ElectrostaticPressure": {"potential": 20.0, "permittivity": 3.5e-11, "least_gap": 1e-9},
    "FaceRule": {
        "face": 3, "name": "foot", "colour": "#ff0000", "plane_normal": [0.0, 0.0, -1.0], "cylinder_radius": 0.01,
        "sphere_radius": 0.01, "cone_angle_deg": 45.0, "all": True,
    },
    "GasPressure": {"values": [[0.0, 1e5], [360.0, 5e6], [540.0, 4e5], [720.0, 1e5]]},
    "Frame": {
        "nodes": {"hub": [0.0, 0.0, 0.0], "far": [0.09, 0.0, 0.0]},
        "members": {"spoke": {"start": "hub", "end": "far", "stations": {"gauge": 0.012}}},
        "groups": {"ring": ["far-east", "far-west"]},
    },
    "Gauge": {"quantity": "strain", "direction": [1.0, 0.0, 0.0], "length": 3e-3},
    "Gear": {"other": "shaft", "ratio": 2.5},
    "GivenForce": {"values": [[0.0, 0.0], [1e-3, 500.0]], "expression": "500*sin(2*pi*100*t)"},
    "GivenPressure": {"values": [[0.0, 0.0], [1e-3, 2e5]], "expression": "1e5*(1 + sin(2*pi*100*t))"},
    "GivenTorque": {"values": [[0.0, 0.0], [1e-3, 5.0]]},
    "GivenWrench": {
        "force": [0.0, 0.0, -1000.0], "moment": [50.0, 0.0, 0.0], "values": [[0.0, 0.0], [1e-3, 1.0]],
        "expression": "sin(2*pi*50*t)",
    },
    "General": {"second_moment": 1e-8, "height": 0.02},
    "Interface": {"extent": [[-0.01, 0.01], [0.0, 0.05]], "tie": "rbe2"},
    "Limits": {"offset": 2e-3},
    "Matrices": {
        "stiffness": "part.sti", "mass": "part.mas", "dofs": "part.dof", "model": "part.inp",
        "stiffness_name": "KGG", "mass_name": "MGG",
    },
    "Member": {"start": "hub", "end": "far", "up": [0.0, 0.0, 1.0], "stations": {"gauge": 0.012}},
    "MeshFile": {"path": "part.msh"},
    "Mistuning": {"values": [0.01, -0.02, 0.005]},
    "ModesSettings": {"boundary": ["foot"], "kept": ["foot"], "interface_count": 10, "reference": "foot"},
    "MovingForce": {"at": [0.0, 0.0]},
    "Orientation": {"quaternion": [0.9238795325, 0.0, 0.0, 0.3826834324], "euler": [30.0, 0.0, 10.0], "order": "zxz"},
    "Orthotropic": {"E": [1.35e11, 1e10, 1e10], "nu": [0.3, 0.3, 0.4], "G": [5e9, 5e9, 3.5e9]},
    "PlaneFile": {"path": "section.msh"},
    "JournalFriction": {"coefficient": 0.1, "speed": 1e-3},
    "JournalWear": {
        "length": 0.02, "thickness": 5e-4, "indentation": 1e-5,
        "bearing_depth": [[0.0, 1e-5, 3e-5, 1e-5, 0.0, 0.0, 0.0, 0.0]],
        "journal_depth": [[1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5]],
    },
    "PointMass": {"inertia": [1e-5, 1e-5, 2e-5]},
    "PoissonRatio": {"nu": 0.45},
    "Rubbing": {"coefficient": 0.3, "press": 1000.0},
    "ParallelPlates": {
        "area": 1e-8, "gap": 2e-6, "least_gap": 1e-9, "potential": 5.0, "charge": 1e-13, "permittivity": 3.5e-11,
        "turn": [0.0, 0.0, 90.0], "direction": [0.0, 0.0, 1.0],
    },
    "Poses": {"pivot": [0.0, 0.0, 0.0]},
    "Report": {"rivals": ["rubin"], "interest": ["floor.impulse"]},
    "Case": {"rules": ["frequencies"]},
    "Restitution": {"value": 0.5},
    "Rotation": {"values": [[0.0, 0.0], [1e-3, 1e-3]], "expression": "1e-3*sin(2*pi*200*t)"},
    "Run": {"accuracy": 1e-3, "window": 1e-5},
    "Samples": {"count": 500},
    "Screw": {"pitch": 2e-3},
    "Slivers": {"aspect": 100.0},
    "Spin": {"angle": 1e-3},
    "Channel": {"gauges": ["top0", "bottom0"], "wiring": "half"},
    "Sensor": {
        "body": "plate", "force": "wrench", "components": ["Fz", "Mx", "My"], "gauge_factor": 2.05, "noise": 1e-7,
        "seed": 1, "drift": 1e-7, "offset": 1e-5, "resolution": 1e-8,
        "channel": {"a": {"gauges": ["top0", "bottom0"], "wiring": "half"}},
    },
    "Spring": {"values": [[-1e-3, -100.0], [0.0, 0.0], [1e-3, 150.0]]},
    "Translation": {"values": [[0.0, 0.0], [1e-3, 1e-4]], "expression": "1e-4*sin(2*pi*200*t)"},
    "Turn": {"ends": [-1.0, 1.0], "points": 9, "values": [-1.0, -0.5, 0.0, 1.0]},
    "Wheel": {"blade_radius": 0.2},
}  # fmt: skip
"""By the name of the table's model."""
