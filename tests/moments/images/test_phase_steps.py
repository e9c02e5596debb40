"""Weights that make moments of images at any phases."""

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images import FOUR_PHASES_RAD, phase_noise, phase_weights
from transientcam_moments.images._four_bucket import demodulate

RNG = np.random.default_rng(20)
SETS = [
    np.arange(3) * 2 * np.pi / 3,
    -np.arange(3) * 2 * np.pi / 3,
    np.arange(5) * 2 * np.pi / 5,
    np.array([0.0, 0.4, 1.1]),
    np.array([0.3, 2.0, 2.0, 4.0, 5.5]),
    np.array(FOUR_PHASES_RAD),
]


@pytest.mark.parametrize("phase", SETS, ids=len)
def test_moments_are_those_that_the_images_were_made_of(phase: np.ndarray) -> None:
    b = RNG.normal(size=(2, 7)) + 1j * RNG.normal(size=(2, 7))
    offset = RNG.uniform(100, 200, size=(2, 7))
    images = offset[:, None] + (b[:, None] * np.exp(-1j * phase)[:, None]).real / 2

    np.testing.assert_allclose(demodulate(images, phase), b, atol=1e-10)


@pytest.mark.parametrize("phase", SETS, ids=len)
def test_of_noisy_images_they_are_the_least_squares(phase: np.ndarray) -> None:
    image = RNG.normal(size=len(phase))
    model = np.stack([np.cos(phase) / 2, np.sin(phase) / 2, np.ones(len(phase))], axis=1)
    (real, imaginary, _), *_ = np.linalg.lstsq(model, image)

    assert phase_weights(phase) @ image == pytest.approx(real + 1j * imaginary)


@pytest.mark.parametrize(
    "quarters", [[0, 1, 2], [1, 2, 3], [3, 2, 1], [0, 1, 2, 2], [0, 1, 2, 3, 3], [0, 1, 2, 3, 0, 2]]
)
def test_some_quarters_of_a_turn_have_the_weights_of_least_squares(quarters: list[int]) -> None:
    phase = np.pi / 2 * np.array(quarters)
    model = np.stack([np.cos(phase) / 2, np.sin(phase) / 2, np.ones(len(phase))], axis=1)
    image = RNG.normal(size=len(phase))
    (real, imaginary, _), *_ = np.linalg.lstsq(model, image)

    assert phase_weights(phase) @ image == pytest.approx(real + 1j * imaginary)


@pytest.mark.parametrize("count", [3, 4, 5, 6, 16])
def test_equidistant_phases_have_the_weights_of_a_fourier_transform(count: int) -> None:
    phase = 2 * np.pi * np.arange(count) / count

    np.testing.assert_allclose(phase_weights(phase), 4 / count * np.exp(1j * phase), atol=1e-14)
    assert phase_noise(phase) == pytest.approx(8 / count)


def test_at_four_phases_they_are_the_four_bucket_sum_to_the_bit() -> None:
    images = RNG.integers(0, 4096, size=(3, 4, 11, 13)).astype(np.uint16)
    order = [2, 0, 3, 1]

    np.testing.assert_array_equal(demodulate(images, FOUR_PHASES_RAD), tm.four_bucket(images))
    shuffled = demodulate(images[:, order], np.array(FOUR_PHASES_RAD)[order])
    np.testing.assert_array_equal(shuffled, tm.four_bucket(images))
    np.testing.assert_array_equal(phase_weights(FOUR_PHASES_RAD), [1, 1j, -1, -1j])


@pytest.mark.parametrize(
    "phase", [[0.0, 1.0], [0.0, 1.0, 1.0 + 2 * np.pi], [0.0, 1.0, np.nan], [[0.0, 1.0, 2.0]]]
)
def test_less_than_three_phases_are_refused(phase: list[float]) -> None:
    with pytest.raises(ParameterError, match="three different phases"):
        phase_weights(phase)


def test_an_image_too_many_is_refused() -> None:
    with pytest.raises(ShapeError, match=r"\(F, 3, \.\.\.\)"):
        demodulate(np.zeros((2, 4, 5)), SETS[0])


@pytest.mark.parametrize(
    ("zeroth", "images"), [("estimated", 6), ("on-off", 8), ("low-frequency", 9)]
)
def test_a_capture_of_three_phases_is_measured(zeroth: str, images: int) -> None:
    b = np.array([9.0, 3 + 4j, -2 + 1j])
    thirds = [b[1], b[2]] if zeroth != "low-frequency" else [9 * np.exp(0.3j), b[1], b[2]]
    raw = [20 + (each * np.exp(-1j * phase)).real / 2 for each in thirds for phase in SETS[0]]
    if zeroth == "on-off":
        raw = [20 + b[0].real / 2, 20.0, *raw]
    assert len(raw) == images

    found = tm.measure(np.array(raw), zeroth=zeroth, phases_rad=tuple(SETS[0]))

    np.testing.assert_allclose(found[1:], b[1:], atol=1e-12)
    assert found[0] == pytest.approx(0.0 if zeroth == "estimated" else 9.0)
