"""Full FE of contact at points."""
