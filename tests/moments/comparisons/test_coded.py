"""A code's correlation, what a camera measures with it, and the returns in that."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.comparisons import Code, coded, equal_shifts_rad, maximum_length_code

SHIFTS = equal_shifts_rad(62)


@pytest.mark.parametrize("bits", [3, 5])
def test_the_correlation_of_a_maximum_length_code_is_a_triangle(bits: int) -> None:
    length = 2**bits - 1
    chip = 2 * np.pi / length
    phase = np.linspace(0, 2 * np.pi, 400, endpoint=False)

    found = maximum_length_code(bits).correlation(phase)

    # 1 at zero falling to -1 / N at a chip, less its mean
    away = np.minimum(phase, 2 * np.pi - phase) / chip
    triangle = np.where(away < 1, 1 - away * (1 + 1 / length), -1 / length)
    assert found == pytest.approx(triangle - 1 / length**2, abs=0.06)  # a truncated series rings
    assert np.abs(found - triangle + 1 / length**2).mean() < 0.01


def test_samples_at_equal_shifts_are_moments_times_the_codes_harmonics() -> None:
    code = maximum_length_code(3)
    contents = np.array(code.contents)
    rng = np.random.default_rng(0)
    phase, weight = oracles.random_returns(rng, returns=4, pixels=5)
    samples = 2 * len(contents) + 1

    y = code.sample(phase, weight, shifts_rad=equal_shifts_rad(samples))

    b = oracles.moments_of_returns(phase, weight, len(contents))
    spectrum = np.fft.fft(y, axis=0)[1 : len(contents) + 1] * 2 / samples
    assert spectrum.conj() == pytest.approx(contents[:, None] * b[1:], abs=1e-10)


def test_two_returns_are_recovered_from_the_samples() -> None:
    rng = np.random.default_rng(1)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=30, apart_rad=0.5)
    weight = weight + 0.2

    found = coded(maximum_length_code().sample(phase, weight, shifts_rad=SHIFTS), sparsity=0.01)

    strong = found.weight > 0.05 * weight.sum(axis=0)
    assert np.all(strong.sum(axis=0) == 2)
    for pixel in range(30):
        at = strong[:, pixel]
        assert oracles.around(found.phase_rad[at, pixel] - phase[:, pixel]).max() < 2e-2
        assert found.weight[at, pixel] == pytest.approx(weight[:, pixel], rel=0.05)


def test_returns_closer_than_a_chip_are_resolved_by_more_shifts() -> None:
    chip = 2 * np.pi / 31
    phase = np.array([[2.0], [2.0 + 0.6 * chip]])
    shifts = equal_shifts_rad(31 * 8)

    found = coded(
        maximum_length_code().sample(phase, np.ones((2, 1)), shifts_rad=shifts),
        shifts_rad=shifts,
        sparsity=1e-3,
    )

    strong = found.weight[:, 0] > 0.2
    assert found.phase_rad[strong, 0] == pytest.approx(phase[:, 0], abs=0.1 * chip)


def test_it_prefers_few_returns_under_noise() -> None:
    rng = np.random.default_rng(2)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=20, apart_rad=0.8)
    weight = weight + 0.3
    y = maximum_length_code().sample(phase, weight, shifts_rad=SHIFTS)
    y += rng.normal(size=y.shape) * np.abs(y).max(axis=0) / 70

    found = coded(y)

    assert np.median((found.weight > 0.02 * weight.sum(axis=0)).sum(axis=0)) <= 3
    assert np.median(oracles.around(found.first_phase_rad() - phase[0])) < 0.02


def test_continuous_light_falls_apart_into_returns() -> None:
    tail = np.linspace(0, 2.0, 400)
    weight = np.exp(-tail / 0.5)
    y = maximum_length_code().sample(1.0 + tail, weight, shifts_rad=SHIFTS)

    found = coded(y, sparsity=0.01)

    assert 3 <= (found.weight > 0).sum() < 62
    # but it is the same light: cumulated, it climbs as the tail does
    come = found.cumulative([1.5, 2.0, 3.1]) / found.weight.sum()
    assert come == pytest.approx(1 - np.exp(-np.array([0.5, 1.0, 2.1]) / 0.5), abs=0.1)


def test_a_code_that_is_repeated_faster_resolves_more_with_the_same_shifts() -> None:
    # harmonics of a coarse waveform at several frequencies: what a camera with few shifts can do
    code = Code(np.array([1.0, 0.0, 0.3, 0.0, 0.15], complex))
    orders = np.repeat(np.arange(1, 9), 2)
    shifts = np.tile([0.0, np.pi / 2], 8)
    phase, weight = np.array([[1.2], [3.0]]), np.array([[1.0], [0.6]])
    y = code.sample(phase, weight, shifts_rad=shifts, harmonics=orders)

    found = coded(y, code=code, shifts_rad=shifts, harmonics=orders, sparsity=0.01)

    strong = found.weight[:, 0] > 0.1
    assert found.phase_rad[strong, 0] == pytest.approx(phase[:, 0], abs=0.02)
    assert found.weight[strong, 0] == pytest.approx(weight[:, 0], rel=0.05)


def test_bad_samples_are_dark_and_disturb_no_other_pixel() -> None:
    y = maximum_length_code().sample(np.full((1, 4), 2.0), np.ones((1, 4)), shifts_rad=SHIFTS)
    y[3, 1] = np.nan
    y[:, 2] = 0

    found = coded(y.astype(np.float32))

    assert np.array_equal(np.isnan(found.first_phase_rad()), [False, True, True, False])
    assert found.first_phase_rad().dtype == np.float32


@pytest.mark.parametrize(
    ("samples", "arguments", "error"),
    [
        (np.ones((62, 1), complex), {}, tm.ShapeError),
        (np.ones(()), {}, tm.ShapeError),
        (np.ones((62, 1)), {"shifts_rad": SHIFTS[:-1]}, tm.ShapeError),
        (np.ones((62, 1)), {"sparsity": -1.0}, tm.ParameterError),
    ],
)
def test_what_are_no_samples_is_refused(
    samples: np.ndarray, arguments: dict[str, object], error: type[Exception]
) -> None:
    with pytest.raises(error):
        coded(samples, **arguments)  # type: ignore[arg-type]  # that is the point


def test_a_code_of_another_length_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match="bits"):
        maximum_length_code(11)
