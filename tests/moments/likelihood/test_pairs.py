"""One or two returns by a search over all pairs of phases, at frequencies with gaps."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.oracles import around

KINECT = (2, 10, 15)
RADIAN_M = float(tm.range_m(np.float64(1.0), 8e6))
Array = NDArray[Any]


def moments(multiples: tuple[int, ...], *returns: tuple[Array, Any]) -> Array:
    j = np.array(multiples)[:, None]
    return np.asarray(sum(weight * np.exp(1j * j * phase) for phase, weight in returns))


def random_pairs(pixels: int, seed: int) -> tuple[Array, Array, Array]:
    """Two phases (P) of which the first is the earlier one, and the weight of the second."""
    rng = np.random.default_rng(seed)
    first = rng.uniform(0.2, 2.5, pixels)
    return first, first + rng.uniform(0.1, 2.5, pixels), rng.uniform(0.3, 0.8, pixels)


def noise_of(multiples: tuple[int, ...], std: float) -> tm.noise.MomentNoise:
    return tm.noise.MomentNoise(np.full(len(multiples), std**2))


def noisy(b: Array, std: float, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return b + std * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))


def least_of_all_pairs(b: Array, multiples: tuple[int, ...], std: float, steps: int) -> float:
    """Least chi-square of one pixel over a grid of pairs, by the normal equations of each."""
    best = np.inf
    waves = np.exp(1j * np.outer(np.arange(steps) * 2 * np.pi / steps, multiples))
    real = np.concatenate([np.real(waves), np.imag(waves)], axis=1) / std
    target = np.concatenate([np.real(b), np.imag(b)]) / std
    for i, j in itertools.combinations(range(steps), 2):
        design = real[[i, j]].T
        weight = np.linalg.solve(design.T @ design, design.T @ target)
        if (weight >= 0).all():
            best = min(best, float(((target - design @ weight) ** 2).sum()))
    return best


@pytest.mark.parametrize("multiples", [KINECT, (1, 3, 4), (1, 2, 3, 4), (2, 3, 7, 12)])
def test_two_returns_without_noise_are_found(multiples: tuple[int, ...]) -> None:
    first, second, ratio = random_pairs(300, 4)
    b = moments(multiples, (first, 500.0), (second, 500 * ratio))

    found = tm.two_returns(b, noise_of(multiples, 0.5), harmonics=multiples)

    off = np.maximum(*around(found.phase_rad - np.stack([first, second])))
    right = (found.count == 2) & (off < 1e-2)
    assert right.mean() > 0.95
    weight = np.stack([np.full(300, 500.0), 500 * ratio])
    assert found.weight[:, right] == pytest.approx(weight[:, right], rel=0.2)
    direct, indirect, _ = found.separate()
    assert (direct + indirect)[right] == pytest.approx(500 * (1 + ratio[right]), rel=0.05)


def test_no_pair_of_a_grid_explains_better() -> None:
    first, second, ratio = random_pairs(6, 11)
    std = 0.1
    b = noisy(moments(KINECT, (first, 1.0), (second, ratio)), std, 12)

    found = tm.two_returns(b, noise_of(KINECT, std), harmonics=KINECT)

    least = [least_of_all_pairs(b[:, p], KINECT, std, steps=90) for p in range(6)]
    two = found.count == 2
    assert two.sum() >= 4
    assert (found.chi_square[two] <= np.array(least)[two] + 0.05).all()


def test_one_return_is_enough_where_noise_explains_what_it_leaves() -> None:
    phase = np.random.default_rng(3).uniform(0, 2 * np.pi, 2000)
    std = 0.02
    b = noisy(moments(KINECT, (phase, 1.0)), std, 5)

    found = tm.two_returns(b, noise_of(KINECT, std), harmonics=KINECT)

    assert (found.count == 1).mean() > 0.995
    one = found.count == 1
    assert np.isnan(found.phase_rad[1, one]).all()
    assert (found.separate().indirect[one] == 0).all()
    off = around(found.phase_rad[0] - phase)[one]
    assert np.sqrt((off**2).mean()) == pytest.approx(
        np.median(found.phase_std_rad[0, one]), rel=0.1
    )
    bound = std / np.sqrt(sum(j * j for j in KINECT))
    assert np.median(found.phase_std_rad[0, one]) == pytest.approx(bound, rel=0.05)


def test_deviations_of_two_returns_are_those_of_noisy_moments() -> None:
    pixels, std = 600, 0.01
    first, second = np.full(pixels, 0.7), np.full(pixels, 1.15)
    b = noisy(moments(KINECT, (first, 1.0), (second, 0.6)), std, 6)

    found = tm.two_returns(b, noise_of(KINECT, std), harmonics=KINECT)

    assert (found.count == 2).mean() > 0.99
    two = (found.count == 2) & (around(found.phase_rad[0] - 0.7) < 0.1)
    assert two.mean() > 0.97
    for k, true in enumerate((0.7, 1.15)):
        spread = (found.phase_rad[k, two] - true).std()
        assert spread == pytest.approx(np.median(found.phase_std_rad[k, two]), rel=0.15)
    for k, true in enumerate((1.0, 0.6)):
        spread = (found.weight[k, two] - true).std()
        assert spread == pytest.approx(np.median(found.weight_std[k, two]), rel=0.15)
    assert found.explained()[two].mean() > 0.99


def test_pixels_without_light_or_number_have_no_return() -> None:
    b = moments(KINECT, (np.full(4, 1.0), 1.0), (np.full(4, 1.5), 0.5))
    b[:, 1] = 0
    b[1, 2] = np.nan
    b[2, 3] = np.inf
    alone = tm.two_returns(b[:, :1], harmonics=KINECT)

    found = tm.two_returns(b, harmonics=KINECT)

    assert found.count.tolist() == [2, 0, 0, 0]
    assert found.phase_rad[:, 0] == pytest.approx(alone.phase_rad[:, 0], abs=1e-5)
    assert not found.weight[:, 1:].any()


def test_a_frequency_alone_has_one_return() -> None:
    found = tm.two_returns(moments((0, 1), (np.array([1.0]), 2.0)), harmonics=(0, 1))

    assert found.count.tolist() == [1]
    assert found.phase_rad[0] == pytest.approx([1.0], abs=1e-4)


@pytest.fixture(scope="module")
def kinect(data_dir: Path) -> tuple[Array, Array]:
    """Moments (3, P) at 80, 16 and 120 MHz of every 249th pixel, and the true path (P) in m.

    From the samples that libfreenect2 decodes, by the equation of the data's description.
    """
    with np.load(data_dir / "kinect2" / "two_returns.npz") as stored:
        samples = stored["decoded"].astype(float).reshape(3, 3, 424, 512)
        response, path_m = stored["p0_response"].tobytes(), stored["path_m"]
    tables = [np.frombuffer(response, "<u2", 424 * 512, 34 + 434_180 * i) for i in range(3)]
    p0_rad = np.stack(tables).reshape(3, 424, 512) * (31e-6 * np.pi)
    assert np.abs(samples).max() < 32_767  # none is saturated
    gain = np.array([1.322581, 1.0, 1.612903])[:, None, None] * np.exp(1j * p0_rad)
    turned = np.exp(-2j * np.pi * np.arange(3) / 3)
    b = 2 / 3 * gain * np.einsum("k,fkyx->fyx", turned, samples)
    path = np.kron(path_m, np.ones((8, 8)))
    return b[:, :, 1:511].reshape(3, -1)[:, ::249], path[:, 1:511].reshape(-1)[::249]


def test_two_returns_of_a_kinect_are_resolved(kinect: tuple[Array, Array]) -> None:
    b, path_m = kinect
    companding = 0.5  # counts: what 11-bit codes leave of the samples

    found = tm.two_returns(b, noise_of(KINECT, companding), harmonics=(10, 2, 15))

    off_m = np.abs(found.separate().phase_rad * RADIAN_M - path_m / 2)
    # libfreenect2's own processor has 44.7 % and 5.9 %
    assert (off_m < 0.05).mean() > 0.95
    assert (off_m < 0.01).mean() > 0.9
