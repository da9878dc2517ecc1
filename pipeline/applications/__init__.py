"""Applications, each a room of its own: `kinds` and the command line import one when a scene or a command names it."""
