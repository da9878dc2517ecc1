"""A person feels the forces on a body of a scene through a device: `gudgeon feel`."""
