"""Kernels beside the planar algorithms: the same results, chosen when they are ready.

A *kernel* is one algorithm compiled for one order m (that of the likelihood for all up to 8) and
one precision, which takes as many pixels at a time as a vector register holds. A planar function
names the kernel that may stand in for it::

    @accelerated("levinson")
    def _coefficients(b): ...

The kernels and their signatures, each that of the planar statement it stands beside
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

``likelihood(b (m+1, P), variance (m+1, P), returns, shapes of tails, error, threshold) ->
attributes of Likelihood``,
or None for other than the usual models

``pairs(b (m+1, P), variance (m+1, P), error) -> attributes of Likelihood``, of two returns

``cumulative``, with the signature of ``density``, is computed on devices only.

``harmonics(given, current, polynomial (m+1, P), mixed (K m, P), inverse (m, P), orders) ->
following (m+1, P), misfit (P)``, or None for orders above 31

``reconstruct(shape, constants) -> OnePass``, found by `lookup`

All others take ``spread=`` to do parts of the pixels on other threads (see `Spread`).
Importing this module imports no compiler: numba is imported by the thread that compiles.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial, wraps
from typing import Any, Final, NamedTuple

import numpy as np

from transientcam_compiled import Cache, Kernels, Spread, on_threads as on_any_threads
from transientcam_moments.errors import ParameterError

PRECISIONS = {"f": "f", "F": "f", "d": "d", "D": "d"}  # of an array's type, by its character
LEAST_PIXELS = 64  # what the widest kernel takes at a time
HEAVY_PIXELS = 4096  # from which a call is worth a kernel that it does not find
PRECISION_NAMES = {"float32": "f", "float64": "d"}
MOST_ROOTS: Final = 8
"""The largest m with kernels for eigenvalues and returns."""
_SINGLE_ONLY: Final = (
    "smooth",
    "neighbours",
    "measure",
    "separate",
    "reconstruct",
    "likelihood",
    "pairs",
    "harmonics",
)
_ANY_ORDER: Final = ("likelihood",)
"""Kernels that take m when they are called, up to `MOST_ROOTS`: compiled once."""
_COMPILING_S: Final = {"likelihood": 10.0, "reconstruct": 8.0, "pisarenko": 8.0, "pairs": 4.0}
_DOUBLE_ONLY: Final = ("covariance", "direct_noise")
_FEW_ROOTS: Final = (
    "neighbours",
    "pisarenko",
    "smallest_eigenvalue",
    "reconstruct",
    "likelihood",
    "covariance",
    "direct_noise",
)

Planar = Callable[..., Any]
Kernel = Callable[..., Any]
Elsewhere = Callable[..., Any] | None
"""Takes name, order and arguments of a kernel; computes the same on a device, or by ``here()``."""
_ELSEWHERE: Final = ContextVar[Elsewhere]("elsewhere", default=None)
EVERYWHERE: Final[list[Elsewhere]] = [None]
"""What is asked outside of `elsewhere`."""
PLANAR: Final[dict[str, Planar]] = {}
"""Planar functions by the names of kernels that may stand in for them."""


@contextmanager
def elsewhere(way: Elsewhere) -> Iterator[None]:
    """Have calls inside ask what may compute them in single precision; None: as outside."""
    token = _ELSEWHERE.set(way or _ELSEWHERE.get())
    try:
        yield
    finally:
        _ELSEWHERE.reset(token)


class Key(NamedTuple):
    """What a kernel is compiled for."""

    name: str
    harmonics: int
    precision: str

    def __str__(self) -> str:
        """As in "levinson m=4 float32", or "likelihood m<=8 float32"."""
        precision = {code: name for name, code in PRECISION_NAMES.items()}[self.precision]
        order = "m<" if self.name in _ANY_ORDER else "m"
        return f"{self.name} {order}={self.harmonics} {precision}"

    @classmethod
    def of(cls, name: str, harmonics: int, precision: str) -> "Key":
        """Return the key of the kernel for an order, which may serve others, too."""
        any_order = name in _ANY_ORDER and 1 <= harmonics <= MOST_ROOTS
        return cls(name, MOST_ROOTS if any_order else harmonics, precision)

    @property
    def is_offered(self) -> bool:
        """Whether there is such a kernel; the planar statement does all orders."""
        if self.name in _SINGLE_ONLY and self.precision != "f":
            return False
        if self.name in _DOUBLE_ONLY and self.precision != "d":
            return False
        if (self.name == "pairs" and self.harmonics < 2) or self.name == "cumulative":
            return False
        # a characteristic polynomial with more roots underflows where they cluster
        return self.harmonics <= MOST_ROOTS or self.name not in _FEW_ROOTS

    @property
    def compiling_s(self) -> float:
        """About how long it takes to compile on an idle processor."""
        return _COMPILING_S.get(self.name, 1.0)


CACHE: Final = Cache(
    "transientcam_moments._kernels",
    "transientcam_moments.arrays",
    "transientcam_moments.images",
    "transientcam_moments.likelihood",
    "transientcam_moments.moment_problem",
    "transientcam_moments.noise",
    "transientcam_moments._dispatch",
)
"""Kernels are compiled of functions of these."""
# The one place that reads the environment; a process has one set of machine code.
KERNELS: Final = Kernels[Key](os.environ, CACHE, expected_s=lambda key: key.compiling_s)


def _planes_less_one(planes: Any, *_: Any) -> int:
    return int(planes.shape[0]) - 1


def accelerated(
    name: str, *, order: Callable[..., int] = _planes_less_one, of: str | None = None
) -> Callable[[Planar], Planar]:
    """Have the kernel ``name`` stand in for a planar function wherever there is one for its data.

    ``name``: one of the kernels of the module's table. It takes the same positional arguments, and
    may return None to leave them to the function.
    ``order``: returns m from those arguments.
    ``of``: character of the only type of array that the kernel takes: any of float32, float64,
    complex64 and complex128, when left out.
    """

    def decorate(planar: Planar) -> Planar:
        PLANAR[name] = planar

        @wraps(planar)
        def run(planes: Any, *rest: Any, spread: Spread | None = None) -> Any:
            way = _ELSEWHERE.get() or EVERYWHERE[0]
            if way is None or not isinstance(planes, np.ndarray) or planes.dtype.char not in "fF":
                return here(planes, *rest, spread=spread)
            by_here = partial(here, planes, *rest, spread=spread)
            return way(name, order(planes, *rest), planes, *rest, here=by_here)

        def here(planes: Any, *rest: Any, spread: Spread | None) -> Any:
            kernel = key = None
            if isinstance(planes, np.ndarray) and planes.ndim:
                precision = PRECISIONS.get(planes.dtype.char) if of is None else "f"
                if precision is not None and of in (None, planes.dtype.char):
                    key = Key.of(name, order(planes, *rest), precision)
                    kernel = _of(key, planes[0].size, computing=True)
            how = {} if spread is None else {"spread": spread}
            found = None if kernel is None else kernel(planes, *rest, **how)
            if found is None:
                found = planar(planes, *rest)
                if kernel is None and key is not None and KERNELS.automatic:
                    KERNELS.returned(key, found)
            return found

        return run

    return decorate


def lookup(name: str, m: int, pixels: int, precision: str = "f") -> Kernel | None:
    """Return the compiled kernel ``name`` of order m for so many pixels in a precision, or None.

    None where the planar statement is to be used: the kernel isn't compiled in this process (yet),
    kernels are off, or there are fewer than 64 pixels. A call with many pixels that does not find
    it has it made ready in the background.
    """
    return _of(Key.of(name, m, precision), pixels)


def _of(key: Key, pixels: int, *, computing: bool = False) -> Kernel | None:
    if pixels < LEAST_PIXELS:
        return None
    kernel: Kernel | None = KERNELS.compiled.get(key)
    if kernel is None and (pixels >= HEAVY_PIXELS or KERNELS.noting) and key.is_offered:
        KERNELS.want(key, computing=computing)
    return kernel


def on_threads(threads: int | None) -> Spread:
    """Return a way to do an image on so many threads, or on all cores, of which one is this.

    Raises ParameterError for less than one thread.
    """
    if threads is not None and (
        isinstance(threads, bool) or not isinstance(threads, int) or threads < 1
    ):
        raise ParameterError("threads", threads, "an integer of at least 1")
    return on_any_threads(threads)
