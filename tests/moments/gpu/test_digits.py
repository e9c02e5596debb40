"""Returns from a device against 60 decimal digits."""

from collections.abc import Iterator
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.gpu_devices import CountingDevice, software_device
from tests.stability import exact
from transientcam_moments import _gpu

PIXELS = 64  # no fewer go to a device
HELD = 4
"""Pixels of a frame that are computed in 60 digits."""
SETTINGS = tm.Settings(estimator="pisarenko", base_frequency_hz=23e6)


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "hostile"])
def device(request: pytest.FixtureRequest) -> Iterator[CountingDevice]:
    with software_device("llvmpipe", hostile=request.param) as found:
        yield found


def returns_of(b: np.ndarray) -> list[tuple[Any, Any]]:
    """Phase and weight of the returns that are left of moments without their uniform part."""
    values, vectors = mp.eighe(exact.toeplitz(exact.exactly(b)))
    b0, m = mp.re(exact.exactly(b)[0]) - values[0], len(b) - 1
    roots = mp.polyroots([vectors[k, 0] for k in range(m, -1, -1)], maxsteps=200, extraprec=300)
    phases = [mp.arg(mp.conj(root)) % (2 * mp.pi) for root in roots]
    powers = mp.matrix([[mp.expj(j * phase) for phase in phases] for j in range(m)])
    weights = mp.lu_solve(powers, mp.matrix([b0, *exact.exactly(b)[1:m]]))
    return [(phase, mp.re(weight)) for phase, weight in zip(phases, weights, strict=True)]


@pytest.mark.parametrize("m", range(1, 9))
def test_returns_agree_with_sixty_digits(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch, m: int
) -> None:
    rng = np.random.default_rng(m)
    # of many returns: beside three alone, what noise adds is weak, and all is ill-conditioned
    b = np.tile(moments(rng, m, 2 * m + 1, PIXELS // 2), 2).astype(np.complex64)
    monkeypatch.setattr(_gpu, "device_of", lambda name: device)
    before = device.frames

    found = tm.Reconstructor(SETTINGS, calibration=np.ones(m + 1), device="gpu")(b).returns

    assert device.frames == before + 1
    most_rad = 4e-5 if device._hostile else 2e-5
    for pixel in range(HELD):
        b0 = float(b[0, pixel].real)
        for phase_rad, weight in returns_of(b[:, pixel]):
            if (share := float(weight) / b0) <= 1e-3:
                continue
            off_rad = np.angle(np.exp(1j * (found.phase_rad[:, pixel] - float(phase_rad))))
            at = int(np.nanargmin(np.abs(off_rad)))
            assert abs(off_rad[at]) <= most_rad
            assert abs(float(found.weight[at, pixel]) / b0 - share) <= 1e-5


def moments(rng: np.random.Generator, m: int, returns: int, pixels: int) -> np.ndarray:
    """Return moments (m + 1, pixels) of random returns, uniform light and noise."""
    phase_rad = rng.uniform(0, 2 * np.pi, (returns, pixels))
    weight = rng.uniform(100, 1000, phase_rad.shape)
    order = np.arange(m + 1)[:, None]
    b = (np.exp(1j * order[:, None] * phase_rad) * weight).sum(axis=1)
    b += rng.normal(0, 5, b.shape) * np.exp(1j * order)
    b[0] = np.abs(b[0]) + 100
    return np.asarray(b)
