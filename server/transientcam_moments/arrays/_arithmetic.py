"""What statements of algorithms need beyond + - * /, for planes of pixels.

Algorithms (`moment_problem`, `likelihood`) are stated once, over real planes: arrays here, and
vectors of pixels where ``_kernels.portable`` compiles the same functions with its own meaning of
the words of this module. All but `repeat` are straight-line arithmetic, and no statement has a
branch that a pixel decides but for `some`, which only saves time.

Banks are small lists of planes, whose sizes follow from tuples of length m, or of the number of
unknowns: only the lengths of these tuples matter. Of a NaN and a number, `larger` and `smaller`
return either.
"""

from typing import Any, Protocol, cast

import numpy as np

from transientcam_moments.arrays import _planes as _arrays
from transientcam_moments.arrays._loops import repeat
from transientcam_moments.arrays._planes import Array, namespace

__all__ = ["repeat"]  # one of the words

Length = tuple[int, ...]
"""A tuple whose length is a size known when a kernel is compiled."""


class Mask(Protocol):
    """Truth values, one a pixel."""

    def __and__(self, other: "Mask", /) -> "Mask": ...
    def __or__(self, other: "Mask", /) -> "Mask": ...
    def __invert__(self) -> "Mask": ...


class Plane(Protocol):
    """Real numbers, one a pixel."""

    def __add__(self, other: "Plane | float", /) -> "Plane": ...
    def __radd__(self, other: float, /) -> "Plane": ...
    def __sub__(self, other: "Plane | float", /) -> "Plane": ...
    def __rsub__(self, other: float, /) -> "Plane": ...
    def __mul__(self, other: "Plane | float", /) -> "Plane": ...
    def __rmul__(self, other: float, /) -> "Plane": ...
    def __truediv__(self, other: "Plane | float", /) -> "Plane": ...
    def __rtruediv__(self, other: float, /) -> "Plane": ...
    def __neg__(self) -> "Plane": ...
    def __abs__(self) -> "Plane": ...
    def __lt__(self, other: "Plane | float", /) -> Mask: ...
    def __le__(self, other: "Plane | float", /) -> Mask: ...
    def __gt__(self, other: "Plane | float", /) -> Mask: ...
    def __ge__(self, other: "Plane | float", /) -> Mask: ...
    def __eq__(self, other: object, /) -> Mask: ...  # type: ignore[override]  # as in NumPy


class Bank(Protocol):
    """A list of planes; registers in a kernel."""

    def __getitem__(self, place: int, /) -> Plane: ...
    def __setitem__(self, place: int, plane: Plane, /) -> None: ...


Pair = tuple[Plane, Plane]
"""Real and imaginary part of a complex plane, or a point x, y."""
Banks = tuple[Bank, Bank]


class _Space(Protocol):
    """What is asked of NumPy, and of what stands in for it."""

    def where(self, mask: Mask, yes: Plane | float, no: Plane | float, /) -> Plane: ...
    def maximum(self, x: Plane, y: Plane | float, /) -> Plane: ...
    def minimum(self, x: Plane, y: Plane | float, /) -> Plane: ...
    def sqrt(self, x: Plane, /) -> Plane: ...


def _space(x: Plane | Mask) -> _Space:
    return cast(_Space, namespace(x))


def bank(like: Plane, length: Length, extra: int) -> Any:
    """Return room for ``len(length) + extra`` planes like one that is at hand.

    A kernel's room is that of the function which asks for it, and gone when that returns: results
    go into banks of the caller's.
    """
    return [like] * (len(length) + extra)


def square_bank(like: Plane, length: Length, extra: int) -> Any:
    """Return room for a square matrix of planes."""
    return [like] * (len(length) + extra) ** 2


def product_bank(like: Plane, length: Length, other: Length) -> Any:
    """Return room for ``len(length) * len(other)`` planes."""
    return [like] * (len(length) * len(other))


def multiply_rows(values: Bank, length: Length, table: Array, out: Bank) -> None:
    """Fill ``out`` with the product of a square matrix of planes and a matrix of numbers.

    A row has as many planes as the tuple is long, and one more; of the table it takes as many rows
    and columns.
    """
    n = len(length) + 1
    rows = namespace(values[0]).stack([values[k] for k in range(n * n)])
    product = table[:n, :n].T @ rows.reshape((n, n, -1))
    for k, plane in enumerate(product.reshape(rows.shape)):
        out[k] = plane


def select(mask: Mask, yes: Plane | float, no: Plane | float) -> Plane:
    """Return ``yes`` where the mask is true, else ``no``; at least one of them is a plane."""
    return _space(mask).where(mask, yes, no)


def some(mask: Mask) -> bool:
    """Say whether a mask is true for a pixel; yes, where that isn't known yet."""
    return _arrays.some(mask)


def larger(x: Plane, y: Plane | float) -> Plane:
    """Return the larger of two."""
    return _space(x).maximum(x, y)


def smaller(x: Plane, y: Plane | float) -> Plane:
    """Return the smaller of two."""
    return _space(x).minimum(x, y)


def magnitude(x: Plane) -> Plane:
    """Return |x|."""
    return abs(x)


def root(x: Plane) -> Plane:
    """Return the square root."""
    return _space(x).sqrt(x)


def lost_by_squaring(x: Array, square: Array) -> Plane:
    """Return what rounding took from a square: x^2 - `square`, exactly (Dekker 1971)."""
    own = getattr(namespace(x), "lost_by_squaring", None)  # of what isn't computed here
    if own is not None:
        return cast(Plane, own(x, square))
    digits = np.finfo(x.dtype).nmant + 1
    shifted = x * float(2 ** ((digits + 1) // 2) + 1)
    high = shifted - (shifted - x)
    low = x - high
    return cast(Plane, ((high * high - square) + 2 * (high * low)) + low * low)


def logarithm(x: Plane) -> Plane:
    """Return log x to single precision, for x from 1/100 to 100, by roots and a series."""
    eighth = root(root(root(x)))
    c = (eighth - 1.0) / (eighth + 1.0)
    square = c * c
    series = 1.0 + square * (1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9))))
    return 16.0 * c * series


def arctangent_terms(precision: object) -> list[float]:
    """Return the coefficients of arctan(t) / t in t^2, as many as count for t <= tan(pi / 8)."""
    return [(-1.0) ** k / (2 * k + 1) for k in range(9 if precision == np.float32 else 21)]


def arctangent_ratio(square: Array) -> Plane:
    """Return arctan(t) / t of `square` = t^2, for 0 <= t <= tan(pi / 8), by its power series."""
    *terms, total = arctangent_terms(square.dtype)
    for term in reversed(terms):
        total = total * square + term
    return cast(Plane, total)


def _of_type(x: Array, value: float) -> Plane:
    return cast(Plane, np.asarray(value, x.dtype))


def rounding(x: Array) -> Plane:
    """Return a few times the rounding error of 1, in the precision of `x`."""
    return _of_type(x, 8 * float(np.finfo(x.dtype).eps))


def least(x: Array) -> Plane:
    """Return a number that is as good as 0 but has a finite inverse, in the precision of `x`."""
    return _of_type(x, float(np.finfo(x.dtype).tiny) ** 0.5)


def eps(x: Array) -> Plane:
    """Return the rounding error of 1, in the precision of `x`."""
    return _of_type(x, float(np.finfo(x.dtype).eps))


def root_eps(x: Array) -> Plane:
    """Return the root of `eps`: the third power of such a step is rounding."""
    return _of_type(x, float(np.finfo(x.dtype).eps) ** 0.5)


def close(x: Array) -> Plane:
    """Return `eps` to the power of 2/3: a step that small which shrinks no more is rounding."""
    return _of_type(x, float(np.finfo(x.dtype).eps) ** (2 / 3))


def tiny(x: Array) -> Plane:
    """Return the least number that isn't subnormal, in the precision of `x`."""
    return _of_type(x, float(np.finfo(x.dtype).tiny))


def largest(x: Array) -> Plane:
    """Return the largest finite number, in the precision of `x`."""
    return _of_type(x, float(np.finfo(x.dtype).max))


def infinity(x: Array) -> Plane:
    """Return infinity, in the precision of `x`."""
    return _of_type(x, np.inf)


def not_a_number(x: Array) -> Plane:
    """Return NaN, in the precision of `x`."""
    return _of_type(x, np.nan)


def large(x: Array) -> Plane:
    """Return a power of two so large that only 1 over it is still far from the least numbers."""
    return _of_type(x, 2.0 ** (np.finfo(x.dtype).maxexp * 3 // 4))


def small(x: Array) -> Plane:
    """Return 1 over `large`."""
    return _of_type(x, 2.0 ** -(np.finfo(x.dtype).maxexp * 3 // 4))
