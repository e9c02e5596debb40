"""The data everything is measured on, and the kernels it is measured with."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments._dispatch import KERNELS, PRECISIONS, lookup
from transientcam_moments._kernels.one_pass import Constants, OnePass
from transientcam_moments.images import gaussian_taps

Array = NDArray[Any]
CORES = len(os.sched_getaffinity(0))
BASE_FREQUENCY_HZ = 23e6
SETTINGS = tm.Settings(
    BASE_FREQUENCY_HZ, "low-frequency", takes=1, estimator="pisarenko", neighbours="gaussian"
)
PAPER = (120, 163)
VGA = (480, 640)


def images(m: int, shape: tuple[int, int]) -> Array:
    """Raw images of a capture, uint16 (4 (m + 1), H, W).

    Direct light, two bounces that vary over the image, shot noise, and read noise of 2 DN.
    """
    rng = np.random.default_rng(m)
    y, x = np.mgrid[: shape[0], : shape[1]] / max(shape)
    phase_rad = np.stack([1 + 1.5 * x + 0.5 * y, 2.5 + x * y, 4 + x])
    weight = np.stack([800 + 600 * np.sin(6 * x), 300 + 300 * y, 150 + 0 * x])
    step = np.exp(-0.5j * np.pi * np.arange(4))[:, None, None]
    raw = np.empty((4 * (m + 1), *shape), np.uint16)
    for j in range(m + 1):
        moment = (weight * np.exp(1j * j * phase_rad)).sum(axis=0)
        clean = 50 + (weight.sum(axis=0) + np.real(moment * step)) / 2
        noisy = rng.poisson(clean) + rng.normal(0, 2, clean.shape)
        raw[4 * j : 4 * j + 4] = np.clip(np.round(noisy), 0, 4095)
    return raw


def moments(m: int, shape: tuple[int, int], dtype: type = np.complex64) -> Array:
    """Biased moments (m + 1, H, W) of the same images."""
    reconstruction = tm.reconstruct(images(m, shape), SETTINGS, calibration=np.ones(m + 1))
    return np.asarray(reconstruction.moments, dtype)


def reconstructor(m: int) -> tm.Reconstructor:
    """Return a reconstructor with the paper's settings, whose pass has to be compiled."""
    one_pass(m, PAPER)
    return tm.Reconstructor(SETTINGS, calibration=np.ones(m + 1))


def one_pass(m: int, shape: tuple[int, int]) -> OnePass:
    """Return the compiled pass of such a reconstructor, which also counts the pixels it redoes."""
    prepare = lookup("reconstruct", m, math.prod(shape))
    if prepare is None:
        raise RuntimeError(f"the pass isn't compiled: {tm.kernels.state()}")
    made: OnePass = prepare(shape, constants(m))
    return made


def constants(m: int) -> Constants:
    """Return what such a pass is made with."""
    range_per_rad_m = float(tm.range_m(np.float64(1), BASE_FREQUENCY_HZ))
    taps = gaussian_taps(SETTINGS.smoothing_sigma_px)
    return Constants(SETTINGS, np.ones(m + 1, np.complex128), taps, range_per_rad_m)


@contextmanager
def numpy_alone() -> Iterator[None]:
    """Leave everything to NumPy inside."""
    kernels = dict(KERNELS.compiled)
    KERNELS.compiled.clear()
    automatic, KERNELS.automatic = KERNELS.automatic, False
    try:
        yield
    finally:
        KERNELS.automatic = automatic
        KERNELS.compiled.update(kernels)


def kernel(name: str, planes: Array) -> Any:
    """Return a compiled kernel, which has to be there."""
    precision = PRECISIONS[planes.dtype.char]
    found = lookup(name, len(planes) - 1, planes[0].size, precision)
    if found is None:
        raise RuntimeError(f"{name} isn't compiled: {tm.kernels.state()}")
    return found
