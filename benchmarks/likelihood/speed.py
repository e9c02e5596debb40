"""How long the likelihood takes for a frame, beside the compiled pass that makes its moments."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import CORES, PAPER, SETTINGS, VGA, images, numpy_alone
from benchmarks.common.tables import Table
from benchmarks.common.timing import measure
from transientcam_moments.likelihood import MODEL_ERROR

ORDERS: Final = (3, 4, 8)
_SENSOR: Final = tm.noise.Sensor(read_noise_e=2.0, dark_dn=50.0, gain_e_per_dn=1.0)
"""That of `benchmarks.data.images`."""


def tables() -> Iterator[Table]:
    """Time two frames of each order and size: light of one return, and of three."""
    tm.kernels.compile(harmonics=ORDERS, precisions=("float32",))
    table = Table(
        "Time of a frame, on one core, single precision",
        (
            "m, pixels",
            "scene",
            "likelihood",
            f"on {CORES} cores",
            "pass of raw images",
            "ratio",
            "planar NumPy",
        ),
        notes=[
            "The pass is the compiled `reconstruct`, from raw images to Pisarenko's returns, in "
            "the same run. One return: one model is fitted. Three returns: all models are. With "
            "the daemon's model error."
        ],
    )
    for m in ORDERS:
        for name, shape in (("163 x 120", PAPER), ("640 x 480", VGA)):
            for returns in (1, 3):
                table.rows.append(_row(m, name, shape, returns))
    yield table


def _row(m: int, name: str, shape: tuple[int, int], returns: int) -> tuple[str, ...]:
    raw = images(m, shape)
    settings = replace(SETTINGS, sensor=_SENSOR)
    reconstructor = tm.Reconstructor(settings, calibration=np.ones(m + 1))
    found = reconstructor(raw)
    moments, noise = np.asarray(found.smoothed), found.noise
    if returns == 1:
        random = np.random.default_rng(m)
        j = np.arange(m + 1)[:, None, None]
        turn = np.exp(1j * j * random.uniform(1, 4, shape))
        b = (1500 * turn).astype(np.complex64)
        assert noise is not None
        moments = tm.noise.draw(b, noise, random, draws=1)[:, 0]
    estimate = partial(tm.likelihood, moments, noise, model_error=MODEL_ERROR)
    kernel = measure(partial(estimate, threads=1))
    spread = measure(partial(estimate, threads=CORES))
    one_pass = measure(partial(reconstructor, raw))
    planar = "-"
    if shape == PAPER:
        with numpy_alone():
            planar = str(measure(partial(estimate, threads=1), least_s=0.1))
    return (
        f"{m}, {name}",
        "one return" if returns == 1 else "three returns",
        str(kernel),
        str(spread),
        str(one_pass),
        f"{kernel.median_s / one_pass.median_s:.1f}",
        planar,
    )
