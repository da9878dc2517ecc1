"""Full FE in a report: its extrapolation as the reference, and its CPU time beside that of settings."""
