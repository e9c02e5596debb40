"""The way back: from light to the packets of a Kinect v2, as an emulated one sends them."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2._layout import (
    HEIGHT,
    IN_ORDER,
    MEASURED,
    SAMPLING,
    SUB_IMAGE_BYTES,
    SUB_IMAGES,
    WIDTH,
)
from transientcam_driver.cameras.kinect2._packets import Footer

PACKET_BYTES: Final = 33_792
"""Longest packet of the isochronous endpoint (`src/libfreenect2.cpp`, wBytesPerInterval)."""
MAGIC: Final = int.from_bytes(b"2RIK", "little"), int.from_bytes(b"TPED", "little")
"""Begin of our footers; what a camera writes there is not known, and no known program reads it."""


def samples(
    moments: NDArray[np.complexfloating[Any, Any]], gains: NDArray[np.complexfloating[Any, Any]]
) -> NDArray[np.floating[Any]]:
    """Return what the sensor measures of light, without noise.

    Parameters
    ----------
    moments : complex array, shape (3, 424, 512)
        At 16, 80 and 120 MHz, in counts.
    gains : complex array, shape (4, 424, 512)
        Of `P0Tables.gains`.

    Returns
    -------
    array, shape (9, 424, 512)
        Signed, in counts, in the order of the stream: for `codes.sub_images`.
    """
    measured = gains[1:] * moments
    phases = np.array(SAMPLING.phases_rad, measured.real.dtype)[None, :, None, None]
    # 1/2 Re(gain b exp(-i phase))
    labelled = measured.real[:, None] * np.cos(phases) + measured.imag[:, None] * np.sin(phases)
    in_stream = np.empty((MEASURED, HEIGHT, WIDTH), labelled.dtype)
    in_stream[list(IN_ORDER)] = labelled.reshape(in_stream.shape) / 2
    return in_stream


def packets(sub_images: NDArray[np.uint8], *, sequence: int, timestamp: int) -> Iterator[bytes]:
    """Return the packets of a frame, with one of length zero behind each sub-image.

    ``sub_images``: uint8 array, shape (9 or 10, `SUB_IMAGE_BYTES`), of `codes.sub_images`; the
    tenth one, of unknown meaning, is 0 where it is left out.
    ``sequence``, ``timestamp``: of the frame, unsigned numbers of 32 bits.
    Raises ValueError for sub-images of another shape.
    """
    if sub_images.shape not in ((MEASURED, SUB_IMAGE_BYTES), (SUB_IMAGES, SUB_IMAGE_BYTES)):
        raise ValueError(f"sub-images of shape {sub_images.shape}, not (9, {SUB_IMAGE_BYTES})")
    for number in range(SUB_IMAGES):
        known = number < len(sub_images)
        image = sub_images[number].tobytes() if known else bytes(SUB_IMAGE_BYTES)
        data = image + Footer(MAGIC, timestamp, sequence, number).pack()
        for begin in range(0, len(data), PACKET_BYTES):
            yield data[begin : begin + PACKET_BYTES]
        yield b""
