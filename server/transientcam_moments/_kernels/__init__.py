"""Compiled lanes beside the planar algorithms: the same results, chosen when they are ready.

A planar function asks ``find`` once and uses what it gets::

    lane = find("levinson", b)
    if lane is not None:
        return lane(b)

The lanes and their signatures, each that of the planar statement it stands beside
(``b`` complex (m+1, ...), NumPy arrays with any trailing shape, strided or not):

``levinson(b) -> error (...), polynomial (m+1, ...), reflection (m, ...)``

``density(polynomial, reflection, error, phase_rad (T,), out (T, ...) or None) -> out``

``smallest_eigenvalue(b) -> (...)``

``pisarenko(b, eigenvalue (...) or None) -> phase_rad, weight (m, ...), uniform, count (...)``

For whole frames in single precision, found by `lookup`:

``measure(images (N, ...) uint16, zeroth) -> moments (m+1, ...)``

``smooth(moments (m+1, H, W), taps) -> (m+1, H, W)``, or None where a moment isn't finite

``separate(phase (m, ...), weight (m, ...), threshold) -> direct, indirect, phase (...)``

All take ``spread=`` to do parts of the pixels on other threads (see ``spread``).
Importing this package imports no compiler: numba is imported by the thread that compiles.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_moments._kernels.registry import LEAST_PIXELS, PRECISIONS, REGISTRY, Key

__all__ = ["find", "lookup"]


def find(name: str, planes: object) -> Callable[..., Any] | None:
    """Return the compiled lane ``name`` for planes of this order and type, or None.

    Parameters
    ----------
    name
        One of the lanes of the module's table.
    planes
        Array (m+1, ...) whose length and dtype choose the lane. Anything but a NumPy array of
        float32, float64, complex64 or complex128 finds nothing.

    Returns
    -------
    lane
        Callable as in the table, or None where the planar statement is to be used: the lane isn't
        compiled in this process (yet), kernels are off, or there are fewer than 64 pixels.
    """
    if not isinstance(planes, np.ndarray) or planes.ndim == 0:
        return None
    precision = PRECISIONS.get(planes.dtype.char)
    if precision is None or planes.size < LEAST_PIXELS * planes.shape[0]:
        return None
    return REGISTRY.compiled.get(Key(name, planes.shape[0] - 1, precision))


def lookup(name: str, m: int, pixels: int) -> Callable[..., Any] | None:
    """Return a lane of order m for so many pixels in single precision, or None, as `find` does."""
    return None if pixels < LEAST_PIXELS else REGISTRY.compiled.get(Key(name, m, "f"))
