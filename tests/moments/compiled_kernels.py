"""Kernels for tests: compiled once a session, and present only in the tests that ask for them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import transientcam_moments as tm
from transientcam_moments._dispatch import KERNELS, PRECISIONS, lookup

CACHE = Path(__file__).resolve().parents[2] / ".pytest_cache" / "kernels"
FEW = tuple(
    name
    for name in tm.kernels.LANES
    if name not in ("likelihood", "pairs", "harmonics", "peaks", "covariance", "direct_noise")
)
"""All but those that few tests need, some of which take longer to compile than all others."""


@contextmanager
def kernels(
    *harmonics: int,
    precisions: tuple[str, ...] = ("float32", "float64"),
    names: tuple[str, ...] = FEW,
) -> Iterator[None]:
    """Have the kernels of these orders inside, as well as those that were there before."""
    before = dict(KERNELS.compiled)
    set_by_user = "NUMBA_CACHE_DIR" in os.environ
    os.environ.setdefault("NUMBA_CACHE_DIR", str(CACHE))
    try:
        tm.kernels.compile(harmonics=harmonics, precisions=precisions, names=names)
        assert not tm.kernels.state()["failed"]
        yield
    finally:
        if not set_by_user:
            del os.environ["NUMBA_CACHE_DIR"]
        KERNELS.compiled.clear()
        KERNELS.compiled.update(before)


@contextmanager
def without_kernels() -> Iterator[None]:
    """Leave everything to NumPy inside."""
    before = dict(KERNELS.compiled)
    KERNELS.compiled.clear()
    try:
        yield
    finally:
        KERNELS.compiled.clear()
        KERNELS.compiled.update(before)


def find(name: str, planes: np.ndarray) -> Any:
    """Return the compiled kernel for planes of this order and type, or None."""
    return lookup(name, len(planes) - 1, planes[0].size, PRECISIONS[planes.dtype.char])
