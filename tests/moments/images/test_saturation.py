import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from transientcam_moments.images import FOUR_PHASES_RAD, recover_saturated

FULL = 4095.0


def images(
    b: NDArray[np.complex128], offset: NDArray[np.float64], phases_rad: tuple[float, ...]
) -> NDArray[np.float64]:
    """Return what an endless scale would show (1, F x phases, P) of moments (F, P)."""
    phase = np.array(phases_rad)[None, :, None]
    shown = offset + 0.5 * (b[:, None] * np.exp(-1j * phase)).real
    return shown.reshape((1, -1, offset.size))


def light(seed: int, pixels: int, m: int = 3) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return moments (m, P) of two returns each, and their offset with other light."""
    random = np.random.default_rng(seed)
    weight = random.uniform(100, 3000, (2, pixels))
    phase = random.uniform(0, 2 * np.pi, (2, pixels))
    j = np.arange(1, m + 1)[:, None, None]
    b = (weight * np.exp(1j * j * phase)).sum(axis=1)
    return b, random.uniform(50, 500, pixels) + weight.sum(axis=0) / 2


@given(
    seed=st.integers(0, 10_000),
    phases=st.sampled_from(
        [
            FOUR_PHASES_RAD,
            (0.0, 2.0, 4.0),
            tuple(np.arange(8) * np.pi / 4),
            (0.3, 1.1, 2.0, 4.4, 5.0),
        ]
    ),
)
def test_what_is_recovered_is_what_an_endless_scale_would_show(
    seed: int, phases: tuple[float, ...]
) -> None:
    endless = images(*light(seed, 50), phases)
    cut = np.minimum(endless, FULL)

    found = recover_saturated(cut, 0, phases, FULL)

    over = (cut == FULL).any(axis=(0, 1))
    if found is None:
        assert not over.any()
        return
    np.testing.assert_array_equal(found.saturated, over)
    known = ~found.undetermined
    np.testing.assert_allclose(found.images[..., known], endless[..., known], rtol=1e-6)
    assert not (found.undetermined & ~over).any()


@given(seed=st.integers(0, 10_000))
def test_a_pixel_stays_open_exactly_where_its_equations_have_several_solutions(seed: int) -> None:
    m, pixels = 2, 40
    endless = images(*light(seed, pixels, m), FOUR_PHASES_RAD)
    cut = np.minimum(endless, FULL)

    found = recover_saturated(cut, 0, FOUR_PHASES_RAD, FULL)

    # unknown: the offset, and two parts for each frequency
    model = np.zeros((4 * m, 1 + 2 * m))
    model[:, 0] = 1
    for j in range(m):
        waves = np.stack([np.cos(FOUR_PHASES_RAD), np.sin(FOUR_PHASES_RAD)], axis=1)
        model[4 * j : 4 * j + 4, 1 + 2 * j : 3 + 2 * j] = waves
    ranks = [np.linalg.matrix_rank(model[cut[0, :, p] < FULL]) for p in range(pixels)]
    expected = np.array(ranks) < 1 + 2 * m
    there = np.zeros(pixels, dtype=bool) if found is None else found.undetermined
    np.testing.assert_array_equal(there, expected)


def test_an_image_before_the_phases_is_never_recovered() -> None:
    cut = np.minimum(images(*light(1, 30), FOUR_PHASES_RAD), FULL)
    cut = np.where((cut < FULL).all(axis=1, keepdims=True), cut, 100.0)  # no other is saturated
    first = np.full((1, 2, 30), 200.0)
    first[0, 0, 4] = FULL

    found = recover_saturated(np.concatenate([first, cut], axis=1), 2, FOUR_PHASES_RAD, FULL)

    assert found is not None
    np.testing.assert_array_equal(np.flatnonzero(found.undetermined), [4])


@pytest.mark.parametrize("value", [FULL - 1, FULL + 1])
def test_nothing_is_recovered_below_and_beyond_the_stated_scale(value: float) -> None:
    stack = np.full((1, 8, 5), 100.0)
    stack[0, 3, 2] = value

    assert recover_saturated(stack, 0, FOUR_PHASES_RAD, FULL) is None


def test_a_pixel_that_is_missing_hides_no_saturated_one() -> None:
    stack = np.full((1, 8, 3), 100.0)
    stack[0, 0, 0], stack[0, 1, 1] = np.nan, FULL

    found = recover_saturated(stack, 0, FOUR_PHASES_RAD, FULL)

    assert found is not None
    np.testing.assert_array_equal(found.saturated, [False, True, False])


@pytest.mark.parametrize(
    "phases", [FOUR_PHASES_RAD, (0.0, 2.0, 4.0), tuple(np.arange(8) * np.pi / 4)]
)
def test_the_variance_of_moments_is_that_of_noisy_images(phases: tuple[float, ...]) -> None:
    random = np.random.default_rng(3)
    b = 800 * np.exp(1j * random.uniform(0, 2 * np.pi, (3, 20_000)))
    clean = images(b, np.full(20_000, 500.0), phases)
    full = float(np.quantile(clean, 0.8))
    noisy = clean + np.sqrt(clean / 500) * random.normal(size=clean.shape)  # as of photons

    found = recover_saturated(np.minimum(noisy, full), 0, phases, full)

    assert found is not None
    turn = np.exp(1j * np.array(phases))
    off = np.einsum("k,fkp->fp", turn, (found.images - clean).reshape(3, len(phases), -1))
    whole = len(phases) * found.variance  # of images with an offset of 500 each
    over = (np.abs(off) ** 2).mean(axis=0) / whole
    known = found.saturated & ~found.undetermined
    for least in np.unique(np.round(found.variance[known], 1)):  # one kind of pixel after another
        alike = known & (np.abs(found.variance - least) < 0.06)
        if alike.sum() > 500:
            assert over[alike].mean() == pytest.approx(1.0, abs=0.25)
    assert over[known].mean() == pytest.approx(1.0, abs=0.15)
    assert (found.variance[~found.saturated] == 1).all()
