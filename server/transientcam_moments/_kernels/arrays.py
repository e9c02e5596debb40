"""The arrays of kernels, contiguous, with pixels last."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Reals = npt.NDArray[np.floating[Any]]
Complexes = npt.NDArray[np.complexfloating[Any, Any]]
Images = npt.NDArray[np.uint16]
Flags = npt.NDArray[np.uint8]
Counts = npt.NDArray[np.int32]
Places = npt.NDArray[np.int64]
Booleans = npt.NDArray[np.bool_]


class FlatReturns(NamedTuple):
    """Returns of all pixels in single precision, flat; their residual says which are wrong.

    Without ``uniform`` the uniform part stays as it is.
    """

    uniform: Any | None
    phase: Any
    weight: Any
    count: Any
    residual: Any
