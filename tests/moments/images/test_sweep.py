"""The phase sweep of a calibration: its phasors without corrupt images, and its harmonics."""

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.oracles import SQUARE, correlation, phasor

STEPS, TAKES, M, PIXELS = 16, 3, 2, 40
CONTENT = {1: 400.0, 3: 12.0 - 5.0j, 5: 3.0j, 7: -2.0}
OFFSET = 900.0
NOISE_DN = 0.4


def swept(seed: int = 0) -> NDArray[np.float64]:
    """Images (Q, takes, 4 m, P) of one return, whose delay differs a little between pixels."""
    rng = np.random.default_rng(seed)
    delay_rad = rng.normal(0.0, 0.05, PIXELS)
    images = np.empty((STEPS, TAKES, 4 * M, PIXELS))
    for step, offset_rad in enumerate(tm.sweep_offsets_rad(STEPS)):
        for image in range(4 * M):
            theta_rad = offset_rad + (image % 4) * np.pi / 2
            j = image // 4 + 1
            images[step, :, image] = OFFSET + np.array(
                [
                    correlation(CONTENT, theta_rad, {k: np.exp(1j * j * k * d) for k in CONTENT})
                    for d in delay_rad
                ]
            )
    return images + rng.normal(0.0, NOISE_DN, images.shape)


def third(phasors: NDArray[np.complex128]) -> complex:
    return complex(tm.waveform_of(phasors, STEPS - 2)[0, 0])


def test_a_sweep_without_corrupt_images_keeps_all_of_them() -> None:
    found = tm.sweep_phasors(swept())

    assert not found.left_out.any()
    assert third(found.phasors) == pytest.approx((12.0 - 5.0j) / 400.0, abs=2e-4)


@pytest.mark.parametrize(
    "corrupt",
    [
        # step, take, image, by how much
        pytest.param(
            [(3, 0, 1, 80.0), (3, 1, 1, -60.0)], id="the same image in two of three takes"
        ),
        pytest.param([(3, 0, 1, 50.0), (3, 0, 3, -50.0)], id="a pair whose sum stays as it was"),
        pytest.param([(9, 1, 2, 2.0)], id="by little more than the noise of a pixel"),
        pytest.param(
            [
                (s, t, i, 90.0 * (-1) ** s)
                for s, t, i in zip(range(16), [0, 1, 2, 1] * 4, [0, 5, 3, 6] * 4, strict=True)
            ],
            id="one image of every step",
        ),
    ],
)
def test_images_that_lost_their_synchronisation_are_left_out(
    corrupt: list[tuple[int, int, int, float]],
) -> None:
    images = swept()
    for step, take, image, by_dn in corrupt:
        images[step, take, image] += by_dn

    found = tm.sweep_phasors(images)

    assert sorted(map(tuple, np.argwhere(found.left_out).tolist())) == sorted(
        (step, take, image) for step, take, image, _ in corrupt
    )
    assert third(found.phasors) == pytest.approx((12.0 - 5.0j) / 400.0, abs=2e-4)


def test_an_image_corrupt_in_all_takes_follows_from_the_opposite_one() -> None:
    images = swept()
    for take, by_dn in enumerate((70.0, -90.0, 140.0)):
        images[5, take, 2] += by_dn

    found = tm.sweep_phasors(images)

    assert found.left_out[5, :, 2].all()
    assert third(found.phasors) == pytest.approx((12.0 - 5.0j) / 400.0, abs=2e-4)


def test_a_pair_corrupt_in_all_takes_leaves_no_phasor() -> None:
    images = swept()
    for take, by_dn in enumerate((70.0, -90.0, 140.0)):
        images[5, take, 0] += by_dn
        images[5, take, 2] += 1.3 * by_dn

    found = tm.sweep_phasors(images)

    assert np.isnan(found.phasors[5, 0]).all()
    assert np.isfinite(np.delete(found.phasors, 5, axis=0)).all()


def test_whole_numbers_without_noise_are_no_outliers() -> None:
    found = tm.sweep_phasors(np.full((4, 2, 4, 3), 7, np.uint16))

    assert not found.left_out.any()
    np.testing.assert_array_equal(found.phasors, 0)


@pytest.mark.parametrize("shape", [(4, 2, 4), (4, 2, 6, 3), (4, 2, 4, 0)])
def test_images_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(tm.ShapeError, match="images"):
        tm.sweep_phasors(np.zeros(shape))


def test_a_sweep_finds_the_fourier_coefficients_of_a_square_wave() -> None:
    steps, count = 60, 7
    delays_rad = np.array([0.0, 0.7, -2.9])
    square = {k: c for k, c in SQUARE.items() if k < 2 * steps}
    phasors = np.array(
        [
            [[phasor(square, d, {k: np.exp(1j * k * p) for k in square}) for p in delays_rad]]
            for d in tm.sweep_offsets_rad(steps)
        ]
    )

    found = tm.waveform_of(phasors, count)

    expected = [float((-1) ** ((k - 1) // 2) / mpmath.mpf(k)) for k in range(3, 17, 2)]
    np.testing.assert_allclose(found, [expected], atol=1e-12)


def test_what_a_sweep_cannot_separate_is_folded_onto_its_mirror_image() -> None:
    content = {1: 1.0, 3: 0.1, 2 * 4 + 1: 0.02}  # four steps separate harmonics up to 7
    phasors = np.array(
        [[[phasor(content, d, dict.fromkeys(content, 1.0))]] for d in tm.sweep_offsets_rad(4)]
    )

    found = tm.waveform_of(phasors, 3)

    np.testing.assert_allclose(found, [[0.1, 0.0, 0.02]], atol=1e-12)  # 9 = 2 x 8 - 7


def test_a_frequency_without_light_has_no_waveform() -> None:
    phasors = np.ones((4, 2, 5), complex)
    phasors[:, 1] = 0

    found = tm.waveform_of(phasors, 2)

    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()


@pytest.mark.parametrize("count", [-1, 4])
def test_a_sweep_of_too_few_steps_is_refused(count: int) -> None:
    with pytest.raises(tm.ParameterError, match="0 to 3 with 4 steps"):
        tm.waveform_of(np.ones((4, 1, 1), complex), count)
    with pytest.raises(tm.ShapeError):
        tm.waveform_of(np.ones((4, 1), complex), 1)
