"""Pictures of a wheel."""

WHEEL: dict[str, dict[str, str]] = {
    "flat": {
        "nodal diameters": "gudgeon.pipeline.applications.wheel.pictures.curves:draw_nodal_diameters",
        "blades": "gudgeon.pipeline.applications.wheel.pictures.curves:draw_blades",
    },
    "rendered": {"wheel": "gudgeon.pipeline.applications.wheel.pictures.shape:draw_wheel"},
}
"""Name → drawing function by group, as `plots.render` takes them."""
