"""What a scene may say, which integrator it takes, and which terms and fields it leads to."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.terms.scene_terms import scene_terms
from gudgeon.solver.system.terms.term import Stock, fields_read
from tests.solver.systems import (
    block_records,
    block_scene,
    build_all,
    driven_pair_scene,
    pair_scene,
    piston_records,
    piston_scene,
    plate_records,
)

DAMPING = {"ratio": 0.01, "frequency": 1000.0}
Change = dict[str, Any]


def merged(scene: Any, change: Any) -> Any:
    """Return a scene with a change put into its tables."""
    if not isinstance(scene, dict) or not isinstance(change, dict):
        return change
    return scene | {key: merged(scene.get(key), value) for key, value in change.items()}


def driven_pair() -> dict[str, Any]:
    """The piston over a plate with damping."""
    return merged(driven_pair_scene(checks=True), {"body": {"plate": {"damping": DAMPING}}})


NEEDY: dict[str, tuple[Change, str]] = {
    "damping": (merged(block_scene(), {"body": {"part": {"damping": DAMPING}}}), "damping of body.part"),
    "joint": (merged(piston_scene(), {"force": {}}) | {"force": {}}, "joint.rod"),
    "joint and force": (piston_scene(), "joint.rod and force.gas"),
    "sliding pair": (merged(pair_scene(), {"run": {"gravity": [0, 0, 0]}}), "the sliding pair contact.slide"),
}


@pytest.mark.parametrize("name", NEEDY)
def test_located_events_are_refused_what_they_cannot_carry(name: str) -> None:
    scene, reason = NEEDY[name]
    with pytest.raises(ValidationError) as error:
        Scene.model_validate(merged(scene, {"run": {"integrator": "event"}}))
    assert f"run.integrator: 'event' does not support {reason}; use 'auto' or 'small'" in str(error.value)
    for integrator in ("auto", "small"):
        chosen = Scene.model_validate(merged(scene, {"run": {"integrator": integrator}}))
        assert chosen.integrator == "small"


def test_all_that_it_cannot_carry_is_named_with_those_that_can() -> None:
    """Up to four elements: what is refused for two reasons is not refused twice."""
    pulled = merged(driven_pair(), {"run": {"gravity": [0, 0, -9.81]}})
    three = "damping of body.plate, joint.rod, force.gas"
    reasons = f"{three} and the sliding pair contact.right"
    with pytest.raises(ValidationError) as error:
        Scene.model_validate(merged(pulled, {"run": {"integrator": "event"}}))
    assert f"run.integrator: 'event' does not support {reasons}; use 'auto' or 'small'" in str(error.value)
    both = merged(
        pulled, {"contact": {"left": {"law": {"kind": "hertz", "stiffness": 1e9}, "surface_stiffness": None}}}
    )
    assert Scene.model_validate(both).loop == "small"


def test_plain_impact_has_steps_of_few_points_too() -> None:
    scene = Scene.model_validate(block_scene())
    assert scene.impulsive
    assert scene.integrator == "small"
    assert scene.carriers()[:2] == ["small", "event"]
    assert not Scene.model_validate(merged(block_scene(), {"run": {"gravity": [0, 0, -9.81]}})).impulsive


FORMER = ("explicit", "implicit", "collocation", "discrete-gradient", "general", "mechanism")


@pytest.mark.parametrize("name", FORMER)
def test_a_former_integrator_is_refused_by_the_name_of_the_present_one(name: str) -> None:
    present = "turning" if name == "mechanism" else "small"
    with pytest.raises(ValidationError, match=f"'{name}' given, a former integrator; use '{present}' or 'auto'"):
        Scene.model_validate(merged(block_scene(), {"run": {"integrator": name}}))


def test_integrator_of_a_run_is_told(tmp_path: Path) -> None:
    for name in ("event", "small"):
        scene = merged(block_scene(4e-5), {"run": {"integrator": name}})
        run = simulate(build_all(tmp_path / name, {"part": block_records(3)}, scene))
        assert run.counts["integrator"] == name
        assert run.motion


@pytest.mark.parametrize(
    ("scene", "change", "text"),
    [
        (
            block_scene(),
            {"contact": {"wall": {"body": "prt"}}},
            "contact.wall.body: no body 'prt', did you mean 'part'? the scene has part",
        ),
        (
            pair_scene(),
            {"contact": {"slide": {"against": {"body": "plte"}}}},
            "contact.slide.against.body: no body 'plte', did you mean 'plate'? the scene has part, plate",
        ),
        (piston_scene(), {"joint": {"rod": {"body": "pston"}}}, "joint.rod.body: no body 'pston', the scene has part"),
        (piston_scene(), {"force": {"gas": {"body": "pston"}}}, "force.gas.body: no body 'pston', the scene has part"),
        (piston_scene(), {"force": {"gas": {"joint": "rd"}}}, "force.gas.joint: no joint 'rd', the scene has rod"),
        (block_scene(), {"body": {"part": {"freedom": ["w"]}}}, "body.part.freedom"),
        (block_scene(), {"body": {"part": {"damping": {"ratio": 1.0, "frequency": 1.0}}}}, "body.part.damping.ratio"),
        (block_scene(), {"body": {"part": {"damping": {"frequency": 5.0}}}}, "give one of: ratio, with or without"),
        (block_scene(), {"body": {"part": {"damping": {"alpha": 1.0, "ratio": 0.1}}}}, "give one of: ratio, with"),
        (block_scene(), {"body": {"part": {"damping": {"alpha": 1.0, "frequency": 1.0}}}}, "frequency belongs to"),
        (block_scene(), {"body": {"part": {"damping": {"values": [[2.0, 0.1], [1.0, 0.1]]}}}}, "rows of rising"),
        (block_scene(), {"body": {"part": {"damping": {"ratios": [0.1, 1.0]}}}}, "body.part.damping.ratios.1"),
        (block_scene(), {"run": {"integrator": "euler"}}, "run.integrator"),
    ],
)
def test_names_and_values_are_checked(scene: Change, change: Change, text: str) -> None:
    with pytest.raises(ValidationError) as error:
        Scene.model_validate(merged(scene, change))
    assert text in str(error.value)


def test_a_truth_value_is_no_number() -> None:
    for key in ("duration", "step"):
        with pytest.raises(ValidationError, match="true given; a number is needed"):
            Scene.model_validate(merged(block_scene(), {"run": {key: True}}))


def test_round_off_in_a_direction_or_a_quaternion_is_zero() -> None:
    turned = {"quaternion": [1.0, 9e-26, -3e-17, 0.0]}
    scene = Scene.model_validate(merged(block_scene(), {"body": {"part": {"orientation": turned}}}))
    assert scene.body["part"].orientation is not None
    assert scene.body["part"].orientation.quaternion == (1.0, 0.0, 0.0, 0.0)
    about = {"axis": [0.0, 9e-26, 2.0], "angle": 30.0}
    scene = Scene.model_validate(merged(block_scene(), {"body": {"part": {"orientation": about}}}))
    assert scene.body["part"].orientation is not None
    assert scene.body["part"].orientation.axis == (0.0, 0.0, 2.0)


def test_joint_that_is_missing_says_so() -> None:
    with pytest.raises(ValidationError, match=r"force\.gas\.joint: no joint 'rod', the scene has none"):
        Scene.model_validate(piston_scene() | {"joint": {}})


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            {"contact": {"slide": {"against": {"interface": "tp"}}}},
            r"^contact\.slide\.against\.interface: body 'plate' has no traction space 'tp'",
        ),
        ({"contact": {"slide": {"interface": "fce"}}}, r"^contact\.slide\.interface: body 'part' has no 'fce'"),
        (
            {"body": {"part": {"position": [-0.06, 0.0, 0.2]}}},
            r"^contact\.slide\.against: no point of 'face' faces 'top'$",
        ),
        ({"body": {"part": {"position": [-0.04, 0.0, 0.0]}}}, r"^contact\.slide: 20 of 20 points start inside"),
    ],
)
def test_pair_that_does_not_fit_is_refused(tmp_path: Path, change: Change, text: str) -> None:
    records = {"part": block_records(20), "plate": plate_records()}
    with pytest.raises(SceneError, match=text):
        build_all(tmp_path, records, merged(pair_scene(), change))


def test_surface_of_another_body_must_face_the_points(tmp_path: Path) -> None:
    records = {"part": block_records(20), "plate": plate_records()}
    records["plate"][0].tractions["top"].chart["normal"] = [1.0, 0, 0]
    scene = merged(pair_scene(), {"body": {"part": {"position": [0.1, 0, 0]}}})
    with pytest.raises(
        SceneError, match=r"^contact\.slide\.against: the obstacle does not face interface 'face': its normals"
    ):
        build_all(tmp_path, records, scene)


def test_points_whose_normals_lead_past_the_obstacle_are_counted_and_one_is_named(tmp_path: Path) -> None:
    modal, morph = block_records(5)
    normals = np.array(modal.interfaces["face"].normals)
    normals[3] = [0.0, 0.0, 1.0]
    turned = replace(modal, interfaces={"face": replace(modal.interfaces["face"], normals=normals)})
    x, y, z = morph.points["face"][3]
    text = (
        f"at 1 of 5 points the normal is more than 8 degrees from the direction to it, 90 at ({x:.4g}, {y:.4g}, {z:.4g}"
    )
    with pytest.raises(SceneError, match=re.escape(text)):
        build_all(tmp_path, {"part": (turned, morph)}, block_scene())


def test_terms_of_a_driven_pair() -> None:
    terms = scene_terms(Scene.model_validate(driven_pair()))
    present = {(term.body, term.name) for term in terms if term.present}
    absent = {(term.body, term.name) for term in terms if not term.present}
    assert present == {
        ("part", "rigid motion"), ("part", "elastic flight"), ("part", "contact right"), ("part", "contact left"),
        ("part", "surface layer of right"), ("part", "surface layer of left"), ("part", "joint rod"),
        ("part", "load gas"), ("part", "residual flexibility"), ("part", "sliding of right"),
        ("plate", "rigid motion"), ("plate", "elastic flight"), ("plate", "traction space top"), ("plate", "damping"),
        ("plate", "residual flexibility"), ("part", "errors of frequencies"), ("plate", "errors of frequencies"),
    }  # fmt: skip
    assert {("part", "gauges"), ("plate", "gauges")} <= absent
    assert {("part", f"{what} of {side}") for what in ("law", "friction") for side in ("right", "left")} <= absent
    assert {("part", "damping"), ("part", "gravity"), ("plate", "gravity"), ("part", "mode shapes")} <= absent
    assert ("part", "dashpot of right") in absent
    reasons = {(term.body, term.name): term.reason for term in terms}
    assert reasons["part", "joint rod"] == "a slider-crank holds pin"
    assert reasons["part", "load gas"] == "gas on crown"
    assert reasons["plate", "traction space top"] == "contact right slides over it"
    assert reasons["plate", "damping"] == "body.plate.damping is given"
    assert reasons["part", "damping"] == "body.part.damping is not given"


def test_fields_of_a_driven_pair() -> None:
    terms = scene_terms(Scene.model_validate(driven_pair()))
    fields = ("rows", "normals", "edge", "areas")
    contact = [f"interfaces/{side}/{name}" for side in ("right", "left") for name in fields]
    own = {"angular_frequencies", "loads/pin", "loads/crown", "residual_flexibility", "discretisation_errors"}
    assert set(fields_read(terms, "part", "modes")) == own | set(contact)
    points = {"points/right", "points/left"}
    assert set(fields_read(terms, "part", "morph")) == {"centre", "inertia", "rigid_twists"} | points
    expected = {"angular_frequencies", "tractions/top", "residual_flexibility", "discretisation_errors"}
    assert set(fields_read(terms, "plate", "modes")) == expected
    assert set(fields_read(terms, "plate", "morph")) == {"centre", "inertia", "rigid_twists"}


RUBS = {"friction": {"static": 0.3, "direction": [0, 1, 0]}}


def tangential(scene: dict[str, Any], body: str, stock: Stock | None = None) -> set[str]:
    """Return the tangential fields that a body's terms read."""
    terms = scene_terms(Scene.model_validate(scene), None if stock is None else {body: stock})
    return {path for path in fields_read(terms, body, "modes") if "tang" in path}


def test_tangential_rows_are_read_where_friction_acts_on_an_elastic_body() -> None:
    own = {"interfaces/face/tangents", "interfaces/face/tangential_rows"}
    assert tangential(block_scene(), "part") == set()
    assert tangential(block_scene(**RUBS), "part") == own
    assert tangential(block_scene(**RUBS), "part", Stock(elastic=False)) == set()
    assert tangential(block_scene(friction=RUBS["friction"] | {"static": 0.0}), "part") == set()


def test_both_sides_of_a_contact_of_two_bodies_read_tangential_rows() -> None:
    scene = block_scene(against={"shape": "body", "body": "other", "interface": "foot"}, **RUBS)
    scene["body"]["other"] = {}
    assert tangential(scene, "other") == {"interfaces/foot/tangents", "interfaces/foot/tangential_rows"}
    assert tangential(scene, "part") == {"interfaces/face/tangents", "interfaces/face/tangential_rows"}
    assert Scene.model_validate(scene).rubbed() == {"part": ("face",), "other": ("foot",)}
    del scene["contact"]["wall"]["friction"]
    assert tangential(scene, "other") == tangential(scene, "part") == set()
    assert Scene.model_validate(scene).rubbed() == {"part": (), "other": ()}


def test_springs_alone_read_no_residual_flexibility() -> None:
    springs = {"slide": {"method": "penalty", "surface_stiffness": 1e13}}
    for scene, read in ((pair_scene(), True), (merged(pair_scene(), {"contact": springs}), False)):
        terms = scene_terms(Scene.model_validate(scene))
        for body in ("part", "plate"):
            assert ("residual_flexibility" in fields_read(terms, body, "modes")) == read


def test_a_body_that_a_joint_holds_reads_it_for_the_joint() -> None:
    springs = {side: {"method": "penalty"} for side in ("right", "left")}
    terms = scene_terms(Scene.model_validate(merged(piston_scene(), {"contact": springs})))
    (term,) = (term for term in terms if term.name == "residual flexibility")
    assert (term.present, term.reason) == (True, "a joint, load, motion or spring acts on it")


def test_only_these_fields_are_in_memory(tmp_path: Path) -> None:
    scene = pair_scene()
    system = build_all(tmp_path, {"part": block_records(20), "plate": plate_records()}, scene)
    plate, part = system.bodies["plate"].modal, system.bodies["part"].modal
    assert list(plate.tractions) == ["top"]
    assert not plate.interfaces
    assert not part.tractions
    assert plate.residual_flexibility is not None
    system = build_all(tmp_path / "piston", {"part": piston_records()}, piston_scene())
    assert sorted(system.bodies["part"].modal.loads) == ["crown", "pin"]
