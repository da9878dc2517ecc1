"""`python -m pipeline` is the `gudgeon` command."""

import sys

from pipeline.cli import main

sys.exit(main())
