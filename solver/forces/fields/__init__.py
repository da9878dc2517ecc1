"""Forces that are the gradient of an energy over the pose of a body."""
