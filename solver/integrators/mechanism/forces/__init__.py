"""Forces of elements between bodies that turn."""
