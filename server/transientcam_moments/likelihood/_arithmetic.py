"""What the fits need beyond + - * /, for planes of pixels.

The fits (`sharp`, `tail`, `linear`) are written once, over real planes: arrays here, and vectors
of pixels where ``_kernels.likelihood`` compiles the same functions with its own meaning of these.
Banks are small lists of planes, whose sizes follow from tuples of length m, or of the number of
unknowns: only the lengths of these tuples matter.
"""

from typing import Any

import numpy as np

from transientcam_moments.arrays import Array, namespace

Bank = Any
"""A list of planes; registers in a lane."""
Length = tuple[int, ...]
"""A tuple whose length is a size known when a lane is compiled."""


def bank(like: Array, length: Length, extra: int) -> Bank:
    """Return room for ``len(length) + extra`` planes like one that is at hand."""
    return [like] * (len(length) + extra)


def square_bank(like: Array, length: Length, extra: int) -> Bank:
    """Return room for a square matrix of planes."""
    return [like] * (len(length) + extra) ** 2


def product_bank(like: Array, length: Length, other: Length) -> Bank:
    """Return room for ``len(length) * len(other)`` planes."""
    return [like] * (len(length) * len(other))


def select(mask: Array, yes: Array, no: Array) -> Array:
    """Return ``yes`` where the mask is true, else ``no``."""
    return namespace(mask).where(mask, yes, no)


def larger(x: Array, y: Array) -> Array:
    """Return the larger of two."""
    return namespace(x).maximum(x, y)


def smaller(x: Array, y: Array) -> Array:
    """Return the smaller of two."""
    return namespace(x).minimum(x, y)


def root(x: Array) -> Array:
    """Return the square root."""
    return namespace(x).sqrt(x)


def logarithm(x: Array) -> Array:
    """Return log x to single precision, for x from 1/100 to 100, by roots and a series."""
    eighth = root(root(root(x)))
    c = (eighth - 1.0) / (eighth + 1.0)
    square = c * c
    series = 1.0 + square * (1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9))))
    return 16.0 * c * series


def rounding(x: Array) -> Array:
    """Return a few times the rounding error of 1, in the precision of `x`."""
    return np.asarray(8 * float(np.finfo(x.dtype).eps), x.dtype)


def least(x: Array) -> Array:
    """Return a number that is as good as 0 but has a finite inverse, in the precision of `x`."""
    return np.asarray(float(np.finfo(x.dtype).tiny) ** 0.5, x.dtype)
