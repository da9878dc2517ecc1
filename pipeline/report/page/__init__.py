"""A report as files: page, picture, tables."""
