"""11-bit codes of a Kinect v2: against libfreenect2's own output, and bit by bit."""

import numpy as np
import pytest

from tests.driver.cameras.kinect2.conftest import Load
from transientcam_driver.cameras.kinect2 import HEIGHT, SUB_IMAGE_BYTES, WIDTH, codes


def sample_by_hand(sub_image: bytes, row: int, column: int) -> int | None:
    """Decode one pixel by the description of the format; None where it is saturated."""
    stored = row if row < 212 else 635 - row
    number = int.from_bytes(sub_image[704 * stored : 704 * (stored + 1)], "little")
    code = number >> 11 * ((column >> 2) + ((column & 3) << 7)) & 2047
    if code == 1024:
        return None
    magnitude, step = 0, 1
    for q in range(code & 1023):
        if q >= 256 and q % 128 == 0:
            step *= 2
        magnitude += step
    return -magnitude if code > 1024 else magnitude


@pytest.mark.data
@pytest.mark.parametrize("scene", ["ramp", "noisy", "two_returns"])
def test_samples_are_those_that_libfreenect2_decodes(vectors: Load, scene: str) -> None:
    stored = vectors(scene)

    images = codes.images(stored["packet"].reshape(10, -1)[:9])

    expected = stored["decoded"].astype(int)
    saturated = expected == 32_767
    assert (images[saturated] == codes.SATURATED_DN).all()
    assert (images[~saturated] == codes.ZERO_DN + expected[~saturated]).all()
    assert saturated.any() == (scene == "noisy")


@pytest.mark.data
def test_magnitudes_are_those_of_libfreenect2s_table(vectors: Load) -> None:
    table = vectors("tables")["lut11to16"].astype(int)

    assert (codes.magnitudes() == table[:1024]).all()
    assert (-codes.magnitudes()[1:] == table[1025:]).all()


def test_every_pixel_is_at_its_place() -> None:
    rng = np.random.default_rng(1)
    data = rng.integers(0, 256, (2, SUB_IMAGE_BYTES), np.uint8)

    images = codes.images(data)

    pixels = rng.integers(0, (2, HEIGHT, WIDTH), (200, 3)).tolist()
    pixels += [[0, row, column] for row in (0, 211, 212, 423) for column in (1, 2, 3, 4, 509, 510)]
    for image, row, column in pixels:
        if column in (0, WIDTH - 1):
            continue
        found = sample_by_hand(data[image].tobytes(), row, column)
        expected = codes.SATURATED_DN if found is None else codes.ZERO_DN + found
        assert images[image, row, column] == expected
    assert (images[:, :, [0, -1]] == codes.ZERO_DN).all()


@pytest.mark.data
def test_encoding_what_was_decoded_gives_the_same_bytes(vectors: Load) -> None:
    data = vectors("noisy")["packet"].reshape(10, -1)[:9]
    images = codes.images(data)
    saturated = images == codes.SATURATED_DN

    again = codes.sub_images(np.where(saturated, np.inf, images.astype(float) - codes.ZERO_DN))

    assert (again == data).all()


def test_a_sample_becomes_the_nearest_code_and_a_large_one_saturates() -> None:
    samples = np.zeros((1, HEIGHT, WIDTH))
    rng = np.random.default_rng(2)
    samples[:, :, 1:-1] = rng.normal(0, 1, (1, HEIGHT, 510)) * 10 ** rng.uniform(0, 4, 510)
    samples[0, 5, 5:9] = [np.nan, -np.inf, 16_321, -16_321]
    samples[0, 6, 5:9] = [16_320, -16_320, -0.4, -0.6]

    images = codes.images(codes.sub_images(samples))[0].astype(int) - codes.ZERO_DN

    levels = np.concatenate([-codes.magnitudes()[:0:-1], codes.magnitudes()])
    fits = np.abs(samples[0]) <= codes.LARGEST
    place = np.searchsorted(levels, samples[0][fits])
    around = levels[np.clip(np.stack([place - 1, place]), 0, len(levels) - 1)]
    nearest = np.abs(around - samples[0][fits]).min(axis=0)
    assert (np.abs(images[fits] - samples[0][fits]) == nearest).all()
    assert (images[~fits] == codes.SATURATED_DN - codes.ZERO_DN).all()
    assert images[6, 5:9].tolist() == [16_320, -16_320, 0, -1]


def test_data_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match=r"\(9, 100\)"):
        codes.images(np.zeros((9, 100), np.uint8))
    with pytest.raises(ValueError, match=r"\(9, 100, 512\)"):
        codes.sub_images(np.zeros((9, 100, 512)))
