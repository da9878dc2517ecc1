"""Pictures of an electrostatic field."""

FIELD: dict[str, dict[str, str]] = {
    "flat": {},
    "rendered": {"charge": "gudgeon.pipeline.applications.electrostatics.pictures.charge:draw_charge"},
}
"""Name → drawing function by group, as `plots.render` takes them."""
