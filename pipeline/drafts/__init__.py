"""First looks at a CAD file: its faces as table and picture, and a scene to begin with."""
