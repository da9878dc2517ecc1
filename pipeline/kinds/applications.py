"""Kinds of scene of applications; their rooms are imported by scenes of these kinds alone."""

from gudgeon.pipeline.stages.base import Kind, Late, Stage

WHEEL = Kind(
    name="wheel",
    model=Late("gudgeon.pipeline.applications.wheel.scene:WheelFile"),
    open=Late("gudgeon.pipeline.applications.wheel.job:wheel_job"),
    stages=(
        Stage(
            "mesh",
            Late("gudgeon.pipeline.applications.wheel.job:mesh_products"),
            Late("gudgeon.pipeline.applications.wheel.job:make_mesh"),
        ),
        Stage(
            "modes",
            Late("gudgeon.pipeline.applications.wheel.job:modes_products"),
            Late("gudgeon.pipeline.applications.wheel.job:make_modes"),
        ),
        Stage(
            "solve",
            Late("gudgeon.pipeline.applications.wheel.job:response_products"),
            Late("gudgeon.pipeline.applications.wheel.job:make_response"),
        ),
    ),
    results=Late("gudgeon.pipeline.applications.wheel.job:results"),
    solved=Late("gudgeon.pipeline.applications.wheel.job:solved"),
    draw=Late("gudgeon.pipeline.applications.wheel.job:draw"),
    commands={
        "plan": Late("gudgeon.pipeline.applications.wheel.plan:plan_wheel"),
        "report": Late("gudgeon.pipeline.applications.wheel.report:report_wheel"),
        "robustness": Late("gudgeon.pipeline.applications.wheel.robustness:wheel_subject"),
    },
)
CONDUCTORS = Kind(
    name="conductor",
    model=Late("gudgeon.pipeline.applications.electrostatics.scene:FieldFile"),
    open=Late("gudgeon.pipeline.applications.electrostatics.job:field_job"),
    stages=(
        Stage(
            "mesh",
            Late("gudgeon.pipeline.applications.electrostatics.job:mesh_products"),
            Late("gudgeon.pipeline.applications.electrostatics.stages:make_mesh"),
        ),
        Stage(
            "solve",
            Late("gudgeon.pipeline.applications.electrostatics.job:field_products"),
            Late("gudgeon.pipeline.applications.electrostatics.stages:make_field"),
        ),
        Stage(
            "poses",
            Late("gudgeon.pipeline.applications.electrostatics.job:pose_products"),
            Late("gudgeon.pipeline.applications.electrostatics.stages:make_poses"),
        ),
    ),
    results=Late("gudgeon.pipeline.applications.electrostatics.stages:results"),
    draw=Late("gudgeon.pipeline.applications.electrostatics.stages:draw"),
    commands={
        "plan": Late("gudgeon.pipeline.applications.electrostatics.stages:plan_field"),
        "report": Late("gudgeon.pipeline.applications.electrostatics.assessment.report:report_field"),
        "robustness": Late("gudgeon.pipeline.applications.electrostatics.assessment.robustness:field_subject"),
    },
)
