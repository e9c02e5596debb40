"""The arrays of kernels, contiguous, with pixels last."""

from typing import Any

import numpy as np
import numpy.typing as npt

Reals = npt.NDArray[np.floating[Any]]
Complexes = npt.NDArray[np.complexfloating[Any, Any]]
Images = npt.NDArray[np.uint16]
Flags = npt.NDArray[np.uint8]
Counts = npt.NDArray[np.int32]
Places = npt.NDArray[np.int64]
Booleans = npt.NDArray[np.bool_]
