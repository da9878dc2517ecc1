"""The forces of all ports of a step together."""
