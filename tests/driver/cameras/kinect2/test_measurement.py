"""Light becomes packets and packets become moments again, by the measurement of every camera."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.driver.cameras.kinect2.conftest import Load
from transientcam_driver.cameras.kinect2 import (
    SAMPLING,
    SUB_IMAGE_BYTES,
    Assembler,
    P0Tables,
    codes,
    encoder,
)

FREQUENCIES_HZ = np.array([16e6, 80e6, 120e6])


def light(path_m: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
    turns = FREQUENCIES_HZ[:, None, None] / tm.SPEED_OF_LIGHT_M_S * path_m
    return np.asarray(amplitude * np.exp(2j * np.pi * turns))


def measured(images: np.ndarray) -> np.ndarray:
    return np.asarray(tm.measure(images, zeroth="estimated", phases_rad=SAMPLING.phases_rad))


@pytest.mark.data
def test_light_is_encoded_to_the_bytes_that_libfreenect2_decoded(vectors: Load) -> None:
    scene = vectors("ramp")
    gains = P0Tables.unpack(scene["p0_response"].tobytes()).gains()
    blocks = np.ones((8, 8))
    b = light(np.kron(scene["path_m"], blocks), np.kron(scene["amplitude"], blocks))

    sub_images = codes.sub_images(encoder.samples(b, gains))

    assert (sub_images == scene["packet"].reshape(10, -1)[:9]).all()


def test_moments_come_back_through_packets() -> None:
    rng = np.random.default_rng(6)
    units = rng.integers(0, 65_536, (3, 424, 512)).astype(np.uint16)
    gains = P0Tables(units).gains()
    # below 256 counts codes are whole numbers
    b = light(rng.uniform(1, 18, (424, 512)), rng.uniform(50, 250, (424, 512)))
    assembler = Assembler()

    sub_images = codes.sub_images(encoder.samples(b, gains))
    sent = encoder.packets(sub_images, sequence=1, timestamp=2)
    (frame,) = [each for each in map(assembler.push, sent) if each is not None]
    found = tm.calibrate(measured(codes.frame_images(frame.data)), gains)

    off = (found[1:] - b)[:, :, 1:-1]
    # rounding spreads evenly over a count: 1/12, times 2/3 of three samples, over the response
    response = np.array([1, 1.322581, 1.612903])[:, None, None]
    std = np.sqrt(2 / 3 / 12) * response
    assert np.abs(off).max() < (2 / 3 * response).max()
    assert off.real.std(axis=(1, 2)) == pytest.approx(std.ravel(), rel=0.02)
    assert np.abs(off.mean(axis=(1, 2))).max() < 0.01
    assert found[1:, :, [0, -1]] == pytest.approx(0, abs=1e-3)


def test_images_are_in_the_order_of_their_labels() -> None:
    sub_images = codes.sub_images(np.arange(9.0)[:, None, None] + np.zeros((9, 424, 512)))

    images = codes.frame_images(sub_images)

    # 16 MHz at 0, 120 and 240 degrees, then 80 and 120 MHz: sub-image k has the phase - 120 k
    order = [3, 5, 4, 0, 2, 1, 6, 8, 7]
    assert (images[:, 7, 7] - codes.ZERO_DN).tolist() == order


def test_sub_images_of_another_size_are_not_sent() -> None:
    with pytest.raises(ValueError, match=r"\(3, 298496\)"):
        next(encoder.packets(np.zeros((3, SUB_IMAGE_BYTES), np.uint8), sequence=1, timestamp=1))
