"""Files of a database in a folder: their names, what is being written, and by whom."""
