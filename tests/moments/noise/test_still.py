"""Averaging over frames: what stands still, what changes, and what must not enter."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm

ORDERS = np.arange(4)[:, None, None]
SHAPE = (24, 30)
VARIANCE = np.array([2.0, 1.0, 1.5, 0.5])[:, None, None]
NOISE = tm.noise.MomentNoise(VARIANCE)
Complexes = NDArray[np.complex128]


def light(later: float = 0.0) -> Complexes:
    """Return moments of one return, of other range and brightness in each column."""
    phase = np.linspace(0.5, 3.0, SHAPE[1]) * np.ones(SHAPE) + later
    found: Complexes = 40.0 * np.exp(1j * ORDERS * phase)
    return found


def noisy(moments: Complexes, random: np.random.Generator) -> Complexes:
    parts = random.standard_normal((2, *moments.shape)) * np.sqrt(VARIANCE)
    found: Complexes = moments + parts[0] + 1j * parts[1]
    found[0] = found[0].real
    return found


def deviation_of_shift() -> float:
    """Return that of the phase of one frame, with all moments (Cramer-Rao, b_0 known)."""
    return float(1 / np.sqrt((ORDERS**2 * 40.0**2 / VARIANCE).sum()))


def streamed(frames: list[Complexes]) -> tm.Still:
    still = None
    for frame in frames:
        still = tm.average_frames(frame, NOISE, still)
    assert still is not None
    return still


def still_frames(count: int, seed: int = 0) -> tuple[list[Complexes], np.random.Generator]:
    random = np.random.default_rng(seed)
    return [noisy(light(), random) for _ in range(count)], random


def test_what_stands_still_is_the_mean_of_all_frames() -> None:
    frames, _ = still_frames(40)

    still = streamed(frames)

    whole = still.frames == 40
    assert whole.mean() > 0.97
    assert np.allclose(still.moments[:, whole], np.mean(frames, axis=0)[:, whole], rtol=1e-12)
    assert np.allclose(still.noise.variance, VARIANCE / still.frames)
    scaled = (still.moments - light())[1:] * np.sqrt(still.frames / VARIANCE[1:])
    assert np.mean(abs(scaled) ** 2) / 2 == pytest.approx(1.0, abs=0.1)


def test_beyond_the_most_frames_the_variance_stays() -> None:
    frames, random = still_frames(1)
    still = streamed(frames)
    seen = []
    for _ in range(40):
        still = tm.average_frames(noisy(light(), random), NOISE, still, most_frames=4)
        seen.append((still.moments - light())[1:][:, still.frames == 4] / np.sqrt(VARIANCE[1:, 0]))
    spread = np.mean([np.mean(abs(each) ** 2) for each in seen[4:]]) / 2

    assert spread == pytest.approx(1 / 4, rel=0.1)


@pytest.mark.parametrize(
    "changed",
    [
        lambda frame: frame + 5 * np.sqrt(2 * VARIANCE),  # each of the numbers
        lambda frame: frame * np.exp(1j * ORDERS * 5 * deviation_of_shift()),
        lambda frame: frame * (1 + 5 / np.sqrt((40.0**2 / VARIANCE).sum())),
    ],
    ids=["all", "range", "brightness"],
)
def test_a_jump_of_five_deviations_gives_the_frame_itself_to_the_bit(
    changed: Callable[[Complexes], Complexes],
) -> None:
    frames, random = still_frames(30)
    still = streamed(frames)
    new = noisy(light(), random)
    jumped = changed(new)
    there = np.zeros(SHAPE, dtype=bool)
    there[:, 15:] = True
    new = np.where(there, jumped, new)

    after = tm.average_frames(new, NOISE, still)

    inside = there.copy()
    inside[:, 15] = False
    assert np.array_equal(after.moments[:, inside], new[:, inside])
    assert (after.frames[inside] == 1).all()
    assert np.median(after.frames[:, :10]) == 31


def test_a_pixel_by_itself_that_jumps_is_itself_at_once_and_no_other() -> None:
    frames, random = still_frames(30)
    new = noisy(light(), random)
    new[:, 12, 12] *= np.exp(1j * ORDERS[:, 0, 0] * 8 * deviation_of_shift())

    after = tm.average_frames(new, NOISE, streamed(frames))

    assert np.array_equal(after.moments[:, 12, 12], new[:, 12, 12])
    assert (after.frames == 1).sum() < 4


@pytest.mark.parametrize("drift", [0.02, 0.1, 0.5, 2.0])
def test_a_slow_ramp_leaves_less_error_than_a_frame_has(drift: float) -> None:
    random = np.random.default_rng(3)
    deviation, still, worst = deviation_of_shift(), None, 0.0
    for k in range(120):
        turned = light(k * drift * deviation)
        frame = noisy(turned, random)
        still = tm.average_frames(frame, NOISE, still)
        off = np.stack([still.moments, frame]) - turned
        later = (off * (1j * ORDERS * turned).conj() / VARIANCE).real.sum(axis=1)
        averaged, single = np.sqrt(np.mean(later**2, axis=(1, 2)))
        worst = max(worst, averaged / single)

    assert worst < 1.05


def test_nothing_spreads_from_pixels_without_a_value() -> None:
    frames, random = still_frames(10)
    full = np.zeros(SHAPE, dtype=bool)
    full[5, 5] = True
    spoilt = [frame.copy() for frame in frames]
    for frame in spoilt:
        frame[1, 8, 8] = np.nan
    still = clean = None
    for bad, good in zip(spoilt, frames, strict=True):
        still = tm.average_frames(bad, NOISE, still, left_out=full)
        clean = tm.average_frames(good, NOISE, clean)
    assert still is not None
    assert clean is not None
    others = ~full
    others[8, 8] = False

    assert np.array_equal(still.moments[:, others], clean.moments[:, others])
    assert np.array_equal(still.moments[:, 5, 5], frames[-1][:, 5, 5])
    assert still.frames[5, 5] == still.frames[8, 8] == 1
    after = tm.average_frames(noisy(light(), random), NOISE, still)
    assert after.frames[5, 5] == after.frames[8, 8] == 1
    assert np.isfinite(after.moments).all()


def test_a_corrupt_frame_shows_the_mean_before_it_and_enters_no_later_one() -> None:
    frames, random = still_frames(20)
    still = streamed(frames)
    bad = noisy(light(), random)
    bad[2, :, :10] += 100.0
    after = tm.average_frames(bad, NOISE, still, corrupt=True)
    new = noisy(light(), random)

    assert np.array_equal(after.moments[:, :, :9], bad[:, :, :9])
    assert np.array_equal(after.moments[:, 5, 20], still.moments[:, 5, 20])
    following = tm.average_frames(new, NOISE, after)
    expected = tm.average_frames(new, NOISE, still)
    assert np.array_equal(following.moments, expected.moments)


@pytest.mark.parametrize("size", [1e-12, 1e9])
def test_a_common_factor_changes_no_decision(size: float) -> None:
    frames, _ = still_frames(25)
    noise = tm.noise.MomentNoise((VARIANCE * size**2).astype(np.float32))
    still = None
    for frame in frames:
        still = tm.average_frames((frame * size).astype(np.complex64), noise, still)

    assert still is not None
    assert (still.frames != streamed(frames).frames).mean() < 0.01


def test_what_does_not_fit_is_refused() -> None:
    frames, _ = still_frames(1)
    with pytest.raises(tm.ParameterError, match="most_frames"):
        tm.average_frames(frames[0], NOISE, most_frames=257)
    with pytest.raises(tm.ShapeError, match="moments"):
        tm.average_frames(frames[0][0], NOISE)
    with pytest.raises(tm.ShapeError, match="before"):
        tm.average_frames(frames[0], NOISE, tm.average_frames(frames[0][:, 1:], NOISE))
    with pytest.raises(tm.ShapeError, match="noise"):
        tm.average_frames(frames[0], tm.noise.MomentNoise(np.ones(3)))
    with pytest.raises(tm.ShapeError, match="left_out"):
        tm.average_frames(frames[0], NOISE, left_out=np.zeros(3, dtype=bool))
    with pytest.raises(tm.ShapeError, match="multiples"):
        tm.average_frames(frames[0], NOISE, multiples=(0, 1))
