"""Probes and gauges of every kind only read: with them, a run of every feature has the same bits as without."""

from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.modaldb.stores.base import Store
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.solver.features import FEATURES, keys_of, scene_of, store_of

SHOWN = ("spring", "bushing")
"""Kinds of forces that a probe reads."""
INTEGRATORS = {"small": {}, "event": {"integrator": "event", "step": None}}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return store_of(tmp_path_factory.mktemp("store"))


def probes_of(scene: Scene) -> dict[str, dict[str, Any]]:
    """Return a probe of every kind that a scene can have."""
    pin = {"body": "part", "interface": "pin"}
    probes: dict[str, dict[str, Any]] = {kind: {"kind": kind} | pin for kind in ("displacement", "velocity")}
    probes["acceleration"] = {"kind": "acceleration", "direction": [1.0, 0.0, 0.0]} | pin
    if "mate" in scene.body:
        probes["distance"] = {"kind": "distance", "against": "mate", "against_interface": "pin"} | pin
    for name in scene.contact:
        probes |= {f"{kind}-{name}": {"kind": kind, "of": f"contact.{name}"} for kind in ("force", "centre")}
    acting = [f"joint.{name}" for name in scene.joint] + [f"motion.{name}" for name in scene.motion]
    acting += [f"force.{name}" for name, force in scene.force.items() if force.kind in SHOWN]
    return probes | {f"force-{name.replace('.', '-')}": {"kind": "force", "of": name} for name in acting}


def solved(store: Store, scene: Scene) -> Trajectory:
    return simulate(compile_system(store, scene, keys_of(("elastic", "rigid"))))


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("feature", [name for name in FEATURES if name not in ("probes", "automatic-step")])
def test_what_only_reads_changes_no_bit(feature: str, integrator: str, store: Store) -> None:
    try:
        scene = scene_of((feature,), **INTEGRATORS[integrator])
        bare = solved(store, scene)
    except (SceneError, ValueError) as refusal:
        pytest.skip(str(refusal))
    table = scene.model_dump(exclude_unset=True) | {"probe": probes_of(scene)}
    read = solved(store, Scene.model_validate(table))
    assert bare.result == read.result
    assert len(read.probes) == len(table["probe"])
    for key in ("frames", "velocities", "energies"):
        np.testing.assert_array_equal(getattr(bare, key), getattr(read, key))
    for name, contact in bare.contacts.items():
        np.testing.assert_array_equal(contact.force, read.contacts[name].force)
        np.testing.assert_array_equal(bare.impacts[name], read.impacts[name])
