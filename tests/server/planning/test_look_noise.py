"""What the noise of a look does to the direct range and to biases, against looks taken again."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_server.planning import SceneStatistics, uniform_scene
from transientcam_server.planning.look_noise import DirectRange, direct_range
from transientcam_server.planning.prediction import Predictor
from transientcam_server.planning.scene import PIXELS
from transientcam_server.settings import ReconstructionSettings

Array = NDArray[Any]
SETTINGS = ReconstructionSettings()
BASE_HZ = 11.5e6
HARMONICS = 12
WALL_M = 2.0
NOISE = 0.004
"""Deviation of the parts of the moments, over the brightness."""


def moments(*returns: tuple[float, float]) -> Array:
    """Moments (m + 1, P) of returns at ranges in m with shares of the light."""
    j = np.arange(HARMONICS + 1)[:, None]
    turn = 4 * np.pi * BASE_HZ / tm.SPEED_OF_LIGHT_M_S
    one = sum(share * np.exp(1j * j * turn * range_m) for range_m, share in returns)
    return np.asarray(np.broadcast_to(one, (HARMONICS + 1, PIXELS)), np.complex64)


def looked(b: Array, seed: int, *, noise: float = NOISE) -> tuple[Array, DirectRange]:
    """Look at moments once: with noise, and what is concluded."""
    variance = np.full(b.shape, noise**2, np.float32)
    variance[0] = 0
    random = np.random.default_rng(seed)
    noisy = tm.noise.draw(b, tm.noise.MomentNoise(variance), random, draws=1)[:, 0]
    return noisy, direct_range(noisy, variance, BASE_HZ, SETTINGS)


def scene(b: Array, seed: int = 1) -> SceneStatistics:
    """Statistics of a scene of equal pixels that was looked at with noise."""
    noisy, found = looked(b, seed)
    return replace(
        uniform_scene(1e6, [(WALL_M, 1.0)]),
        direct_m=found.direct_m,
        uncertainty_m=found.uncertainty_m,
        base_frequency_hz=BASE_HZ,
        measured=noisy,
        relative_noise=np.full(PIXELS, NOISE),
        repeats=found.repeats,
    )


def test_noise_alone_is_no_uncertainty_of_the_direct_range() -> None:
    _, found = looked(moments((WALL_M, 1.0)), 1)

    std_rad = NOISE / np.sqrt(np.sum(np.arange(1, HARMONICS + 1) ** 2))
    least_m = tm.range_m(std_rad, BASE_HZ)
    assert np.median(found.uncertainty_m) == 0.0
    assert np.median(found.direct_m) == pytest.approx(WALL_M, abs=0.5 * least_m)
    assert np.std(found.direct_m) < 2 * least_m


def test_what_the_estimators_differ_by_beyond_noise_is_uncertainty() -> None:
    omega = 2 * np.pi * BASE_HZ * np.arange(HARMONICS + 1)[:, None]
    tail = 0.7 + 0.3 / (1 - 1j * omega * 1e-9)  # 30 % of the light decays within 1 ns
    blurred = (moments((WALL_M, 1.0)) * tail).astype(np.complex64)

    _, found = looked(blurred, 1, noise=NOISE / 4)

    assert np.median(found.uncertainty_m) > 0.003
    assert np.median(found.direct_m) > WALL_M + 0.003


@pytest.mark.parametrize("harmonics", [1, 3])
def test_the_noise_of_a_bias_is_that_of_looks_taken_again(harmonics: int) -> None:
    b = moments((WALL_M, 1.0))
    apart_m = []
    for seed in range(12):
        noisy, found = looked(b, seed)
        phase = np.angle(noisy[harmonics]) / harmonics
        apart_m.append(tm.range_m(phase, BASE_HZ) - found.direct_m)

    _, found = looked(b, 99)
    repeated = np.angle(found.repeats.moments[harmonics]) / harmonics
    variance_m2 = found.repeats.variance_m2(np.asarray(tm.range_m(repeated, BASE_HZ)))

    again_m2 = np.var(np.array(apart_m), axis=0).mean()
    assert variance_m2.mean() == pytest.approx(again_m2, rel=0.35)


@pytest.mark.parametrize("estimator", ["single-frequency", "maximum-entropy", "likelihood"])
def test_a_noisy_look_at_a_wall_predicts_no_bias(estimator: str) -> None:
    sequence = Sequence(harmonics=2, base_frequency_hz=46e6, exposure_s=0.004, takes=16)

    with_noise = Predictor(scene(moments((WALL_M, 1.0))), tm.noise.Sensor(), SETTINGS)
    naive = Predictor(
        replace(with_noise.scene, repeats=None, measured=with_noise.scene.measured),
        tm.noise.Sensor(),
        SETTINGS,
    )

    bias_m = with_noise.predict(estimator, sequence).range_bias.median
    assert bias_m < 0.25 * naive.predict(estimator, sequence).range_bias.median


def test_a_bias_above_the_noise_of_the_look_is_kept() -> None:
    b = moments((WALL_M, 0.75), (WALL_M + 1.0, 0.25))
    predictor = Predictor(scene(b), tm.noise.Sensor(), SETTINGS)
    sequence = Sequence(harmonics=1, base_frequency_hz=23e6, exposure_s=0.004, takes=16)

    predicted = predictor.predict("single-frequency", sequence)

    mixed_m = tm.range_m(np.angle(b[2, 0]) % (2 * np.pi), 23e6)
    assert predicted.range_bias.median == pytest.approx(mixed_m - WALL_M, rel=0.05)
    assert predictor.least_bias_m("single-frequency", sequence) == pytest.approx(
        0.8 * (mixed_m - WALL_M), rel=0.05
    )
