"""`python -m gudgeon.pipeline` is the `gudgeon` command."""

import sys

from gudgeon.pipeline.cli import main

sys.exit(main())
