"""The arrays that most of this program works on."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
