"""Types that records are made of."""

from typing import Any

import numpy as np

Array = np.ndarray
FORMER = "former"
"""Key of a field's metadata: its name in files of older versions."""
Json = dict[str, Any]
