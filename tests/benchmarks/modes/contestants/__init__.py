"""The contestants: each module is a script, `python -m … MESH COUNT`, that prints one JSON line."""
