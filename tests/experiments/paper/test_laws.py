"""What single figures measure, against closed forms and naive computations."""

import numpy as np
import pytest

from transientcam_experiments.paper import Bench, figure03, figure05, figure07, figure11, figure12
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS
from transientcam_experiments.paper.contenders import CONTENDERS, Contender
from transientcam_experiments.paper.outcome import Outcome
from transientcam_experiments.paper.synthetic import CONTINUOUS, PIXEL


@pytest.mark.parametrize(("kind", "n"), [("none", 1), ("arccos", 8), ("harmonic-cancellation", 3)])
def test_figure_3_measures_a_triangles_harmonics_times_the_gain_of_phase_steps(
    bench: Bench, kind: str, n: int
) -> None:
    phase = 2 * np.pi * np.arange(2048) / 2048
    triangle = np.arccos(np.cos(phase)) - np.pi / 2

    curve = figure03.measured(bench, triangle, figure03.Steps(kind, n))  # type: ignore[arg-type]  # parametrised words

    k = np.array([1, 3, 5, 7, 9])
    if kind == "arccos":
        at, weight = np.arccos(1 - (2 * np.arange(n) + 1) / n), np.ones(n)
    elif kind == "none":
        at, weight = np.zeros(1), np.ones(1)
    else:
        at, weight = np.arange(n) * np.pi / (n + 1), np.sin((np.arange(n) + 1) * np.pi / (n + 1))
    gain = np.abs((weight * np.exp(-1j * k[:, None] * at)).sum(axis=1)) / weight.sum()
    expected = gain / k**2  # of a triangle
    spectrum = np.abs(np.fft.rfft(curve))
    assert spectrum[k] / spectrum[1] == pytest.approx(expected / expected[0], abs=1e-4)
    assert (spectrum[2:10:2] / spectrum[1]).max() < 1e-4  # opposite images have no even ones


def test_figure_7_holds_measures_with_the_same_moments_against_the_bounds() -> None:
    b = CONTINUOUS.moments(23e6, 5)
    phase = 2 * np.pi * np.arange(4096) / 4096

    several = figure07.candidates(b, phase, 6, np.random.default_rng(0))

    # smoothing multiplies moment k by r^k
    found = several @ np.exp(1j * phase[:, None] * np.arange(6)) * (2 * np.pi / 4096)
    expected = b * 0.93 ** np.arange(6)
    assert np.abs(found - expected).max() < 1e-4 * CONTINUOUS.brightness
    assert len({round(float(each.max()), 3) for each in several}) > 4  # they do differ


def test_figure_7_finds_the_interval_with_a_maximum() -> None:
    phase = np.linspace(0, 6, 601)
    peak = np.exp(-((phase - 3) ** 2))

    begin, end = figure07.must_peak(phase, 0.9 * peak, 1.1 * peak)

    # where 1.1 exp(-x^2) falls below 0.9
    half = np.sqrt(np.log(1.1 / 0.9))
    assert (begin, end) == pytest.approx((3 - half, 3 + half), abs=0.02)


def test_figure_5_is_singular_where_it_says() -> None:
    b = PIXEL.moments(23e6, 5)
    j = np.arange(6)
    both = np.concatenate([b[:0:-1].conj(), b])
    least = np.linalg.eigvalsh(both[j[:, None] - j + 5]).min()

    singular = figure05.singular_brightness(b)

    assert singular == pytest.approx(67.5 - least, rel=1e-6)


def test_figure_11_measures_errors_and_spread_of_cumulative_densities() -> None:
    truth = np.array([0.0, 0.5, 1.0, 1.0])
    noisy = np.stack([truth, truth + np.array([0, 0.2, 0, 0])], axis=1)
    found = Outcome(np.arange(4) * 1e-9, truth, truth + 0.1, noisy)

    assert found.clean_error == pytest.approx(0.1)
    assert found.noisy_error == pytest.approx(0.2 / 8)
    assert found.spread == pytest.approx(0.1 / 4)
    assert found.error_at(2.2e-9) == pytest.approx(0.1)


def test_figure_11_says_which_rivals_are_better() -> None:
    errors = dict.fromkeys((each.name for each in CONTENDERS), 0.5)
    errors |= {"maximum-entropy": 0.02, "pisarenko": 0.03, "spumic": 0.01, "sra": 0.025}

    text = figure11.ranked("Some case", errors)

    assert "maximum entropy (0, 23 .. 69 MHz) with 2.00%" in text
    assert "better: after Kirmani et al. 2013 (SPUMIC)" in text
    assert "is beaten by: after Freedman et al. 2014 (SRA) (23, 46, 69 MHz) 2.50%" in text


def test_figure_12_counts_missing_ranges_as_outliers_but_not_in_the_error() -> None:
    truth = np.full((1, 4), 2.0)
    range_m = np.array([[2.0, 2.04, 2.2, np.nan]])
    ranged = figure12.Ranged(Contender("sra", 23e6, 3), range_m, truth)

    assert ranged.rms_m == pytest.approx(np.sqrt((0.04**2 + 0.2**2) / 3))
    assert ranged.median_m == pytest.approx(0.04)
    assert ranged.outliers == pytest.approx(0.5)


def test_figure_12_looks_along_the_lines_of_sight(bench: Bench) -> None:
    shot = bench.shot("corner", figure12.DATA, options=WITHOUT_OUTLIERS)

    points = figure12.directions(shot) * shot.truth.range_m

    # the walls meet at x = 0, 2.4 m away, and come closer by as much as they go aside
    assert np.abs(points[0]) + points[1] == pytest.approx(np.full(shot.lit.shape, 2.4), abs=0.03)


def test_single_frequency_ranges_are_phases_of_the_first_moment(bench: Bench) -> None:
    shot = bench.shot("corner", figure12.DATA, options=WITHOUT_OUTLIERS)

    ranged = figure12.ranged_by(Contender("single-frequency", 23e6, 1), shot, 16)

    b_1 = np.asarray(shot.found.smoothed)[1, ::16, ::16]
    metres = np.remainder(np.angle(b_1), 2 * np.pi) / (2 * np.pi * 23e6) * 299_792_458 / 2
    assert ranged.range_m == pytest.approx(metres, abs=1e-4)
