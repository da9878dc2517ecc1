"""The error budget of a setting: basis, step, mesh, spline spacing and contact layer."""
