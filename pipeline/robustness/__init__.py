"""`gudgeon stress`: the extremes of a scene, and whether each comes out right."""
