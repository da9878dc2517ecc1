"""Full FE of bodies that slide over each other."""
