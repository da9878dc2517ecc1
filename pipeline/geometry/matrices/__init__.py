"""Bodies whose stiffness and mass another program assembled: readers of its files, and the surfaces of its elements."""
