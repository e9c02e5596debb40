"""The arrays of kernels, contiguous, with pixels last; their annotations are what is compiled."""

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt


class Form(NamedTuple):
    """How many axes a compiled function's array has, and what: "real" is of its precision."""

    axes: int
    element: str


Reals = npt.NDArray[np.floating[Any]]
Complexes = npt.NDArray[np.complexfloating[Any, Any]]
Booleans = npt.NDArray[np.bool_]
RealPlane = Annotated[Reals, Form(1, "real")]
RealPlanes = Annotated[Reals, Form(2, "real")]
ComplexPlanes = Annotated[Complexes, Form(2, "complex")]
WideRealPlane = Annotated[Reals, Form(1, "float64")]
WideRealPlanes = Annotated[Reals, Form(2, "float64")]
WideComplexPlanes = Annotated[Complexes, Form(2, "complex128")]
Images = Annotated[npt.NDArray[np.uint16], Form(2, "uint16")]
Flags = Annotated[npt.NDArray[np.uint8], Form(1, "uint8")]
Counts = Annotated[npt.NDArray[np.int32], Form(1, "int32")]
Places = Annotated[npt.NDArray[np.int64], Form(1, "int64")]
Table = Annotated[npt.NDArray[np.int64], Form(2, "int64")]


class FlatReturns(NamedTuple):
    """Returns of all pixels in single precision, flat; their residual says which are wrong.

    Without ``uniform`` the uniform part stays as it is.
    """

    uniform: Any | None
    phase: Any
    weight: Any
    count: Any
    residual: Any
