"""Compiled lanes beside the planar algorithms: the same results, chosen when they are ready.

A *lane* is one algorithm compiled for one order m and one precision, which takes as many pixels at
a time as a vector register holds. A planar function names the lane that may stand in for it::

    @accelerated("levinson")
    def _coefficients(b): ...

The lanes and their signatures, each that of the planar statement it stands beside
(``b`` complex (m+1, ...), NumPy arrays with any trailing shape, strided or not):

``levinson(b, brightness (...) or left out) -> error (...), polynomial (m+1, ...), reflection (m,
...)``

``density(polynomial, reflection, error, phase_rad (T,)) -> (T, ...)``, also into ``out``

``peaks(polynomial (m+1, P), reflection (m, P), error (P), threshold) -> first, strongest (P),
phase, density (m, P)``

``smallest_eigenvalue(b) -> (...)``

``pisarenko(b, eigenvalue (...) or None) -> phase_rad, weight (m, ...), uniform, count (...)``

``covariance(phase (m, P), variance (m, P)) -> (2m, 2m, P)``, of returns, in double precision

``direct_noise(phase (m, P), weight (m, P), variance (m, P), threshold, clear, coincide_rad) ->
deviation of the direct phase, whether first order holds, whether all m returns are there (P)``, in
double precision; the first two say nothing where they are not

For whole frames in single precision:

``measure(images (N, ...) uint16, zeroth) -> moments (m+1, ...)``

``smooth(moments (m+1, H, W), taps) -> (m+1, H, W)``, or None for other moments and where one
isn't finite

``separate(weight (m, ...), phase (m, ...), threshold) -> direct, indirect, phase (...)``

``likelihood(b (m+1, P), variance (m+1, P), returns, tail_shape) -> attributes of Likelihood``,
or None for other than the usual models

``pairs(b (m+1, P), variance (m+1, P), error) -> attributes of Likelihood``, of two returns

``harmonics(given, current, polynomial (m+1, P), mixed (K m, P), inverse (m, P), orders) ->
following (m+1, P), misfit (P)``, or None for orders above 31

``reconstruct(shape, constants) -> OnePass``, found by `lookup`

All others take ``spread=`` to do parts of the pixels on other threads (see ``parallel``).
Importing this package imports no compiler: numba is imported by the thread that compiles.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from transientcam_moments._lanes.automatic import returned, want
from transientcam_moments._lanes.parallel import Spread
from transientcam_moments._lanes.registry import (
    HEAVY_PIXELS,
    LEAST_PIXELS,
    PRECISIONS,
    REGISTRY,
    Key,
)

__all__ = ["accelerated", "find", "lookup"]

Planar = Callable[..., Any]


def _planes_less_one(planes: Any, *_: Any) -> int:
    return int(planes.shape[0]) - 1


def accelerated(
    name: str, *, order: Callable[..., int] = _planes_less_one, of: str | None = None
) -> Callable[[Planar], Planar]:
    """Have the lane ``name`` stand in for a planar function wherever there is one for its data.

    Parameters
    ----------
    name
        One of the lanes of the module's table. It takes the same positional arguments, and may
        return None to leave them to the function.
    order
        Returns m from those arguments.
    of
        Character of the only type of array that the lane takes; those of `find`, when left out.
    """

    def decorate(planar: Planar) -> Planar:
        @wraps(planar)
        def run(planes: Any, *rest: Any, spread: Spread | None = None) -> Any:
            lane = key = None
            if isinstance(planes, np.ndarray) and planes.ndim:
                precision = PRECISIONS.get(planes.dtype.char) if of is None else "f"
                if precision is not None and of in (None, planes.dtype.char):
                    key = Key(name, order(planes, *rest), precision)
                    lane = _of(key, planes[0].size, computing=True)
            how = {} if spread is None else {"spread": spread}
            found = None if lane is None else lane(planes, *rest, **how)
            if found is None:
                found = planar(planes, *rest)
                if lane is None and key is not None and REGISTRY.automatic:
                    returned(key, found)
            return found

        return run

    return decorate


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
        compiled in this process (yet), kernels are off, or there are fewer than 64 pixels. A call
        with many pixels that does not find it has it made ready in the background.
    """
    if not isinstance(planes, np.ndarray) or planes.ndim == 0:
        return None
    precision = PRECISIONS.get(planes.dtype.char)
    return None if precision is None else lookup(name, len(planes) - 1, planes[0].size, precision)


def lookup(name: str, m: int, pixels: int, precision: str = "f") -> Callable[..., Any] | None:
    """Return a lane of order m for so many pixels in a precision, or None, as `find` does."""
    return _of(Key(name, m, precision), pixels)


def _of(key: Key, pixels: int, *, computing: bool = False) -> Callable[..., Any] | None:
    if pixels < LEAST_PIXELS:
        return None
    lane = REGISTRY.compiled.get(key)
    if lane is None and (pixels >= HEAVY_PIXELS or REGISTRY.noting):
        want(key, computing=computing)
    return lane
