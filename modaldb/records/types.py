"""Types that records are made of."""

from typing import Any

import numpy as np

Array = np.ndarray
FORMER = "former"
"""Key of a field's metadata: its name in files of older versions."""
COLUMNS = "columns"
"""Key of a field's metadata: number of columns of its arrays; older files have fewer, and the others become NaN."""
Json = dict[str, Any]
