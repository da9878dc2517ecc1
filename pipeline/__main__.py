"""`python -m gudgeon.pipeline` is the `gudgeon` command."""

from gudgeon.pipeline.cli import entry

entry()
