"""Types that records are made of."""

from typing import Any

import numpy as np

Array = np.ndarray
Json = dict[str, Any]
