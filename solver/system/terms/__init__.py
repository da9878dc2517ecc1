"""Terms of the equations of motion, and the fields of the records that they read."""
