"""Averaging over neighbours compiled, against its planar statement."""

from collections.abc import Iterator

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.compiled_kernels import find, kernels, without_kernels
from transientcam_moments._dispatch import on_threads


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with kernels(3, precisions=("float32",), names=("neighbours",)):
        yield


@pytest.mark.parametrize("shape", [(40, 53), (64, 1), (3, 40)])
def test_it_is_the_planar_statement_but_for_rounding(shape: tuple[int, int]) -> None:
    m = 3
    rng = np.random.default_rng(m)
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    phase = 0.5 + 3e-3 * columns + 0.3 * (columns > shape[1] // 2) + 0.01 * (rows % 6 == 0)
    b = 900 * np.exp(1j * np.arange(m + 1)[:, None, None] * phase)
    b = (b + 9 * rng.normal(size=b.shape) + 9j * rng.normal(size=b.shape)).astype(np.complex64)
    b[1, 2, 0] = np.nan
    frames = 1 + rows % 3
    noise = tm.noise.MomentNoise((81 / frames * np.ones(b.shape)).astype(np.float32))
    left_out = (rows == 1) & (columns == 0)
    assert find("neighbours", b) is not None

    how = {"left_out": left_out, "frames": frames}
    found = tm.average_neighbours(b, noise, **how)
    threads = tm.average_neighbours(b, noise, **how, spread=on_threads(2))
    with without_kernels():
        planar = tm.average_neighbours(b, noise, **how)

    assert np.allclose(found.moments, planar.moments, atol=900 * 1e-5, equal_nan=True)
    assert np.allclose(found.share, planar.share, rtol=1e-3)
    assert np.array_equal(threads.moments, found.moments, equal_nan=True)
    assert np.array_equal(threads.share, found.share)
