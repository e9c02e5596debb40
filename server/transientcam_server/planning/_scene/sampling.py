"""Which pixels stand for a scene, and what other such samples would have been.

Scenes have pixels of several kinds: a wall and a piece of wax before it. The median over all is
somewhere among those of one kind, at a place that depends on how many there are of the other. Drawn
by chance, 128 pixels know that share to 4 %; taken evenly from lit pixels in the order of their
kind, to less than 1 %. What these few leave undecided is decided by eight times as many.
"""

import itertools
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[Any]
STRATUM: Final = 8
"""Pixels of the sample that are of one kind, from the dimmest to the brightest."""
KINDS_SPREAD: Final = 0.03
"""Standard deviation of the share of pixels that are predicted to be of another kind than they are:
as far as predicted and measured shares of outliers are apart (docs/plans.md)."""


def typical_pixels(b: _Array, count: int) -> _Array:
    """Return which of N pixels stand for all, ``count`` of them, by their kind.

    ``b``: (m + 1, N) moments of the lit pixels.
    ``count``: A multiple of `STRATUM`; pixels are taken repeatedly where there are fewer.
    """
    strata = _evenly(np.argsort(coherence(b), kind="stable"), count // STRATUM)
    light = np.abs(b[1])
    chosen = [_middles(each[np.argsort(light[each], kind="stable")]) for each in strata]
    return np.concatenate(chosen)


def one_of_each(count: int) -> _Array:
    """Return which of ``count`` pixels of `typical_pixels` stand for them, `STRATUM` times fewer.

    One of each kind, dim and bright ones by turns.
    """
    kind = np.arange(count // STRATUM)
    return np.asarray(kind * STRATUM + (3 * kind + kind // STRATUM) % STRATUM)


def coherence(b: _Array) -> _Array:
    """Return how much the moments (m + 1, N) are those of one return: 1 where they are.

    That is the modulus of their mean, each turned back by the phase of the first and over its
    modulus.
    """
    m = len(b) - 1
    size = np.maximum(np.abs(b[1]), 1e-12)
    back = np.conj(b[1]) / size
    j = np.arange(1, m + 1)[:, None]
    found: _Array = np.abs((b[1:] * back**j).sum(axis=0)) / (m * size)
    return found


def resampled(count: int, samples: int, seed: int) -> _Array:
    """Return places (samples, count) of other samples of as many pixels.

    Each is of the same kinds, but these are as much more or less frequent as a prediction may be
    wrong about them: the first ones by a share that has the deviation `KINDS_SPREAD`, at most.
    """
    random = np.random.default_rng(seed)
    place = (np.arange(count) + 0.5) / count
    tilt = 4 * KINDS_SPREAD * random.normal(size=(samples, 1))
    tilted = np.clip(place + tilt * place * (1 - place), 0.0, 1.0 - 1e-9)
    first = (tilted * count).astype(int) // STRATUM * STRATUM
    width = np.minimum(STRATUM, count - first)
    return np.asarray(first + random.integers(0, width))


def _evenly(order: _Array, parts: int) -> list[_Array]:
    """Cut an order into so many parts, which share elements where there are too few."""
    edges = np.linspace(0, order.size, parts + 1)
    return [
        order[int(low) : max(int(high), int(low) + 1)] for low, high in itertools.pairwise(edges)
    ]


def _middles(order: _Array) -> _Array:
    """Return `STRATUM` elements at equal distances."""
    places = (np.arange(STRATUM) + 0.5) / STRATUM * order.size
    return np.asarray(order[places.astype(int)])
