"""The pipeline: scenes, meshes, modes, designs, pictures, reports. Its functions for notebooks stand in `gudgeon`."""
