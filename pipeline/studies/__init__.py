"""Many designs of one scene: which they are, their runs on several processes or machines, and the table of results."""
