"""`gudgeon robustness`: the robustness cases of a scene, and whether each comes out right."""
