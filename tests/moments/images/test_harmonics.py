"""Harmonics of the modulation, taken out of the moments."""

from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.compiled_kernels import kernels, without_kernels
from tests.moments.oracles import Content, phasor
from transientcam_moments.images._harmonics import ROUNDS

Array = NDArray[np.complex128]


def measured(
    content: Content, returns: list[tuple[float, float]], m: int, delay_rad: float
) -> Array:
    """Moments a_0 .. a_m / 2 that a pixel of this delay measures of sharp returns."""

    def b(n: int) -> complex:
        return complex(sum(w * np.exp(1j * n * (phi + delay_rad)) for phi, w in returns))

    rest = [phasor(content, 0.0, {k: b(k * j) for k in content}) / 2 for j in range(1, m + 1)]
    return np.array([b(0), *rest])


def calibrated(
    content: Content, returns: list[tuple[float, float]], m: int, delay_rad: float
) -> tuple[Array, Array, Array]:
    """Return moments b~ as a calibration leaves them, its gains, and the true moments."""
    gains = measured(content, [(0.0, 1.0)], m, delay_rad)
    true = np.array([sum(w * np.exp(1j * n * phi) for phi, w in returns) for n in range(m + 1)])
    return measured(content, returns, m, delay_rad) / gains, gains, true


def columns(content: Content, m: int, count: int) -> Array:
    """Waveform (m, K) of a correlation that is the same at all frequencies."""
    first = content[1]
    turn = np.conj(first) / abs(first)
    row = [content.get(k, 0) * turn**k / abs(first) for k in range(3, 2 * count + 3, 2)]
    return np.tile(np.array(row, dtype=complex), (m, 1))


def error(b: Array, true: Array) -> float:
    return float((np.abs(b - true) / true[0].real).max())


# -- taking them out -------------------------------------------------------------------------------

KNOWN = {1: 1.0, 3: 0.02 - 0.01j, 5: 0.006j, 7: 0.012, 9: -0.004}
TWO = [(0.9, 1.0), (2.4, 0.5)]


def test_two_returns_come_out_a_hundred_times_nearer() -> None:
    b, gains, true = calibrated(KNOWN, TWO, 4, delay_rad=0.3)

    correction = tm.HarmonicCorrection(columns(KNOWN, 4, 4), gains, ())
    found = correction(b)

    assert error(b, true) > 0.02
    assert error(found.moments, true) < 1e-2 * error(b, true)
    assert found.corrected.all()


def test_exact_moments_of_the_model_are_its_fixed_point() -> None:
    # one return of any phase: its extension is exact, but for the bias of the maximum entropy
    b, gains, true = calibrated(KNOWN, [(4.0, 2.0)], 3, delay_rad=-1.1)

    found = tm.HarmonicCorrection(columns(KNOWN, 3, 4), gains, ())(b).moments

    # 27 times |c_k| times what epsilon takes of b_27: the bias of Sec. 4.3, nothing else
    assert error(found, true) < 0.05 * 27 * 4e-3


def test_the_phase_of_the_modulation_itself_does_not_matter() -> None:
    turned = {k: c * np.exp(1j * k * 0.8) for k, c in KNOWN.items()}

    np.testing.assert_allclose(columns(turned, 3, 4), columns(KNOWN, 3, 4), atol=1e-12)
    b, gains, true = calibrated(turned, TWO, 3, delay_rad=0.2)
    found = tm.HarmonicCorrection(columns(turned, 3, 4), gains, ())(b).moments
    assert error(found, true) < 0.05 * error(b, true)


def test_a_zeroth_moment_that_was_not_measured_stays_so() -> None:
    b, gains, true = calibrated(KNOWN, TWO, 4, delay_rad=0.3)
    b[0] = 0

    found = tm.HarmonicCorrection(columns(KNOWN, 4, 4), gains, (), estimated=True)(b).moments

    assert found[0] == 0
    true = np.append(0, true[1:])
    assert np.abs(found - true).max() < 0.1 * np.abs(b - true).max()


def test_smoothed_moments_are_corrected_by_smoothed_gains() -> None:
    delays_rad = np.random.default_rng(5).normal(0, 0.2, (12, 11))
    pixels = [calibrated(KNOWN, TWO, 3, delay) for delay in delays_rad.ravel()]
    b, gains, true = (
        np.stack([pixel[i] for pixel in pixels], -1).reshape(4, 12, 11) for i in range(3)
    )
    correction = tm.HarmonicCorrection(
        columns(KNOWN, 3, 4), gains, (12, 11), smoothing_sigma_px=0.6
    )

    found = correction(tm.smooth(b, 0.6)).moments

    assert error(found, true) < 0.1 * error(tm.smooth(b, 0.6), true)


def misfit(b: Array, given: Array, content: Content, gains: Array, delay: float) -> float:
    """Distance of what the model makes of moments and their extension from the measured ones.

    By a recursion of mpmath's numbers: nothing of the code under test but the biased moments.
    """
    m, top = len(b) - 1, 9 * (len(b) - 1)
    valid = [mpmath.mpc(complex(x)) for x in tm.bias(b).moments]
    matrix = mpmath.matrix(m, m)
    for i in range(m):
        for j in range(m):
            matrix[i, j] = valid[i - j] if i >= j else mpmath.conj(valid[j - i])
    a = mpmath.lu_solve(matrix, mpmath.matrix([-valid[i + 1] for i in range(m)]))
    known = [mpmath.mpc(complex(x)) for x in b]
    for n in range(m + 1, top + 1):
        known.append(-sum(a[j - 1] * known[n - j] for j in range(1, m + 1)))
    total = mpmath.mpf(0)
    for j in range(1, m + 1):
        higher = {k: complex(known[k * j]) * np.exp(1j * k * j * delay) for k in content}
        expected = phasor(content, 0.0, higher) / 2 / gains[j]
        single = phasor(content, 0.0, {k: np.exp(1j * k * j * delay) for k in content}) / 2
        # in the unit of b_j, as the steps of the iteration are
        u = content[1] * np.exp(1j * j * delay)
        total += abs((expected - given[j]) * (single / u)) ** 2
    return float(mpmath.sqrt(total))


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 6),
    strength=st.floats(0.0, 0.95),
    noise=st.sampled_from([0.0, 1e-2, 0.3]),
)
def test_the_misfit_never_grows(seed: int, count: int, strength: float, noise: float) -> None:
    random = np.random.default_rng(seed)
    returns = [tuple(each) for each in random.uniform((0, 0.1), (2 * np.pi, 1), (count, 2))]
    turning = np.array([4, 4, 8, 8])  # k + 1 or k - 1 of 3, 5, 7, 9
    size = random.uniform(0, 1, 4)
    size *= strength / (size @ turning)
    phases_rad = random.uniform(0, 2 * np.pi, 4)
    content = {1: 1.0} | dict(zip((3, 5, 7, 9), size * np.exp(1j * phases_rad), strict=True))
    delay = float(random.uniform(-np.pi, np.pi))
    b, gains, _ = calibrated(content, returns, 3, delay)
    b[1:] += noise * b[0].real * (random.normal(size=3) + 1j * random.normal(size=3))

    found = tm.HarmonicCorrection(columns(content, 3, 4), gains, ())(b).moments

    assert found[0] == b[0]
    with mpmath.workdps(30):
        before, after = (misfit(each, b, content, gains, delay) for each in (b, found))
    # harmonics below the negligible share are left out of the one, and not of the other
    assert after <= before * (1 + 1e-6) + 1e-3 * abs(b[0])


def test_pixels_that_are_not_finite_stay_and_disturb_no_other() -> None:
    b, gains, _ = calibrated(KNOWN, TWO, 4, delay_rad=0.3)
    planes, of_each = np.tile(b[:, None], 4), np.tile(gains[:, None], 4)
    planes[2, 1], planes[0, 2], of_each[1, 3] = np.nan, 0, 0

    found = tm.HarmonicCorrection(columns(KNOWN, 4, 4), of_each, (4,))(planes)

    alone = tm.HarmonicCorrection(columns(KNOWN, 4, 4), gains, ())(b)
    np.testing.assert_allclose(found.moments[:, 0], alone.moments, rtol=1e-12)
    np.testing.assert_array_equal(found.moments[:, [1, 3]], planes[:, [1, 3]])
    assert found.corrected.tolist() == [True, False, found.corrected[2], False]


def test_without_harmonics_nothing_changes() -> None:
    b, gains, _ = calibrated({1: 1.0}, TWO, 4, delay_rad=0.3)

    for waveform in (np.zeros((4, 5)), np.empty((4, 0)), np.full((4, 2), 1e-5)):
        found = tm.HarmonicCorrection(waveform, gains, ())(b)
        np.testing.assert_array_equal(found.moments, b)
        assert not found.corrected.any()


@pytest.mark.parametrize(
    ("waveform", "problem"),
    [
        (np.ones(4), tm.ShapeError),
        (np.zeros((0, 3)), tm.ShapeError),
        (np.full((4, 1), np.nan), tm.ParameterError),
        (np.full((4, 2), 0.13), tm.ParameterError),
        (np.full((3, 1), 0.1), tm.ShapeError),
        (np.array([["a"]] * 4), tm.ShapeError),
    ],
)
def test_a_waveform_that_cannot_be_one_is_refused(
    waveform: NDArray[np.generic], problem: type[tm.MomentsError]
) -> None:
    with pytest.raises(problem):
        tm.HarmonicCorrection(waveform, np.ones(5), ())


def test_the_kernel_gives_what_the_planes_give() -> None:
    random = np.random.default_rng(3)
    pixels = [
        calibrated(KNOWN, [(p, 1.0), (p + 0.8, 0.5)], 3, d)
        for p, d in random.uniform((0, -1), (4, 1), (100, 2))
    ]
    b, gains = (np.stack([pixel[i] for pixel in pixels], -1) for i in range(2))
    b = b.astype(np.complex64)
    correction = tm.HarmonicCorrection(columns(KNOWN, 3, 4), gains, (100,))
    with without_kernels():
        planar = correction(b)
    with kernels(3, precisions=("float32",), names=("harmonics",)):
        compiled = correction(b)

    np.testing.assert_allclose(compiled.moments, planar.moments, atol=2e-5)
    assert compiled.corrected.mean() == pytest.approx(planar.corrected.mean(), abs=0.02)


@pytest.mark.data
@pytest.mark.parametrize(("n", "gain"), [(4, 15), (8, 8)])
def test_a_measured_waveform_behind_measured_delays_comes_out(
    data_dir: Path, n: int, gain: float
) -> None:
    """The measured correlation of a KEA camera, behind arccos sub-phases, and a board's delays."""
    rows = np.load(data_dir / "modulation" / "keatof_2MHz_ham-k3_min.npy")
    spectrum = np.conj(np.fft.rfft(rows[0] - rows[1]))
    p = np.arccos(1 - (2 * np.arange(n) + 1) / n)
    content = {k: spectrum[k] * np.exp(-1j * k * p).mean() for k in range(1, 32, 2)}
    codes = np.fromfile(data_dir / "modulation" / "TintinCDKCameraPhaseOffset.bin", "<i2")[2:]
    delay_rad = codes[:: len(codes) // 400] * (2 * np.pi / 4096)
    phase_rad = np.random.default_rng(1).uniform(0.5, 3.5, (2, len(delay_rad)))
    phase_rad[1] += 0.6  # most of them apart

    def a(j: int, phases_rad: NDArray[np.float64], weights: tuple[float, ...]) -> Any:
        def b(k: int) -> Any:
            return sum(
                w * np.exp(1j * k * j * (phi + delay_rad))
                for phi, w in zip(phases_rad, weights, strict=True)
            )

        parts = (np.conj(c * b(k)) if k % 4 == 3 else c * b(k) for k, c in content.items())
        return sum(parts)

    one = np.ones(len(delay_rad), complex)
    gains = np.stack([one] + [a(j, 0 * phase_rad[:1], (1.0,)) for j in range(1, 5)])
    measured_ = np.stack([1.5 * one] + [a(j, phase_rad, (1.0, 0.5)) for j in range(1, 5)])
    true = np.stack(
        [np.exp(1j * j * phase_rad[0]) + np.exp(1j * j * phase_rad[1]) / 2 for j in range(5)]
    )

    b = measured_ / gains
    correction = tm.HarmonicCorrection(columns(content, 4, 14), gains, delay_rad.shape)

    before, after = (np.abs(each - true).max(0) for each in (b, correction(b).moments))
    assert np.median(after) < np.median(before) / gain
    assert np.percentile(after, 90) < np.percentile(before, 90) / 4


# -- in a reconstruction ---------------------------------------------------------------------------


def frame() -> tuple[Array, Array, Array]:
    random = np.random.default_rng(8)
    pixels = [calibrated(KNOWN, TWO, 3, d) for d in random.normal(0, 0.2, 96)]
    b, gains, true = (np.stack([p[i] for p in pixels], -1).reshape(4, 8, 12) for i in range(3))
    return b.astype(np.complex64), gains, true


def test_a_reconstruction_says_of_how_many_pixels_they_were_taken_out() -> None:
    b, gains, true = frame()
    settings_ = tm.Settings(base_frequency_hz=23e6, zeroth="on-off", takes=1)
    raw = (b * gains).astype(np.complex64)

    plain = tm.reconstruct(raw, settings_, calibration=gains)
    found = tm.reconstruct(raw, settings_, calibration=gains, waveform=columns(KNOWN, 3, 4))

    assert plain.corrected_pixels is None
    assert found.corrected_pixels == 96
    assert error(found.smoothed, true) < 0.1 * error(plain.smoothed, true)


def test_the_compiled_pass_follows_the_correction() -> None:
    b, gains, _ = frame()
    settings_ = tm.Settings(base_frequency_hz=23e6, zeroth="on-off", takes=1, estimator="pisarenko")
    raw = (b * gains).astype(np.complex64)
    with without_kernels():
        staged = tm.reconstruct(raw, settings_, calibration=gains, waveform=columns(KNOWN, 3, 4))
        range_m = staged.range_m
    with kernels(3, precisions=("float32",), names=("reconstruct",)):
        passed = tm.reconstruct(raw, settings_, calibration=gains, waveform=columns(KNOWN, 3, 4))

    assert "returns" in vars(passed), "the pass did not serve it"
    assert passed.corrected_pixels == staged.corrected_pixels
    np.testing.assert_allclose(passed.smoothed, staged.smoothed, atol=1e-5)
    np.testing.assert_allclose(passed.range_m, range_m, atol=2e-3)


def test_a_waveform_without_a_calibration_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match="calibration"):
        tm.reconstruct(np.ones((3, 4), complex), waveform=np.zeros((2, 1)))


def test_each_round_brings_the_moments_nearer() -> None:
    b, gains, true = calibrated(KNOWN, TWO, 4, delay_rad=0.3)
    correction = tm.HarmonicCorrection(columns(KNOWN, 4, 4), gains, ())

    errors, current = [error(b, true)], b[:, None]
    for _ in range(ROUNDS):
        current, _ = correction._round(b[:, None], current, tm.kernels.at_once)
        errors.append(error(current[:, 0], true))

    assert errors == sorted(errors, reverse=True)
