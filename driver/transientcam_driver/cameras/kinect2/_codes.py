"""The 11-bit codes of a sub-image: where they stand, and which samples they mean.

Both are read in `src/cpu_depth_packet_processor.cpp` of OpenKinect/libfreenect2. Displayed row v is
stored row v in the upper half and 635 - v in the lower one. A row holds its columns 0, 4, 8, ...
first, then 1, 5, ... and so on, 11 bits each, the least significant bit first. Codes are companded:
steps of 1 up to 256, and twice as large behind every further 128 codes.
"""

from collections.abc import Iterator
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2._layout import (
    CODE_BITS,
    HEIGHT,
    IN_ORDER,
    ROW_BYTES,
    SUB_IMAGE_BYTES,
    WIDTH,
)

BITS: Final = 15
"""Of the images that are handed on."""
ZERO_DN: Final = 1 << (BITS - 1)
"""What a sample of 0 is in an image; a sample s is ``ZERO_DN + s``."""
SATURATED_DN: Final = (1 << BITS) - 1
"""What a saturated sample is: the highest code, as of every camera."""
SATURATED_CODE: Final = 1024
LARGEST: Final = 16_320
"""Of the magnitudes that there are codes for."""
_SIGN: Final = 1024
_LINEAR: Final = 256
_SEGMENT: Final = 128
_LANES: Final = 4  # columns 0, 4, 8, ...; 1, 5, ...
_GROUP: Final = 8  # codes, which are 11 bytes
_GROUPS: Final = WIDTH // _LANES // _GROUP
_MASK: Final = (1 << CODE_BITS) - 1


@cache
def magnitudes() -> NDArray[np.int32]:
    """Return the magnitude (1024,) of each code without its sign."""
    code = np.arange(_SIGN)
    segment = np.maximum(code - _LINEAR, 0) // _SEGMENT
    within = code - _LINEAR - segment * _SEGMENT
    companded = (_LINEAR << segment) + (within << (segment + 1))
    return np.where(code < _LINEAR, code, companded).astype(np.int32)


@cache
def _dn_of_code() -> NDArray[np.uint16]:
    positive = ZERO_DN + magnitudes()
    table = np.concatenate([positive, 2 * ZERO_DN - positive])
    table[SATURATED_CODE] = SATURATED_DN
    return table.astype(np.uint16)


@cache
def _code_of_half_counts() -> NDArray[np.uint16]:
    """Return the nearest code of each magnitude, by twice the magnitude: codes meet at halves."""
    levels = magnitudes()
    between = (levels[1:] + levels[:-1]) / 2
    halves = np.arange(2 * LARGEST + 1) / 2
    return np.searchsorted(between, halves, side="right").astype(np.uint16)


def images(data: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Decode sub-images.

    Parameters
    ----------
    data : uint8 array, shape (N, `SUB_IMAGE_BYTES`)

    Returns
    -------
    uint16 array, shape (N, 424, 512)
        In DN: `ZERO_DN` and the signed sample, or `SATURATED_DN`; rows as they are displayed. The
        first and the last column, which the sensor does not use, hold `ZERO_DN`.

    Raises
    ------
    ValueError
        For data of another shape.
    """
    if data.ndim != 2 or data.shape[1] != SUB_IMAGE_BYTES:
        raise ValueError(f"sub-images of shape {data.shape}, not (N, {SUB_IMAGE_BYTES})")
    made = np.empty((len(data), HEIGHT, WIDTH), np.uint16)
    half = HEIGHT // 2
    for image, sub_image in zip(made, np.ascontiguousarray(data), strict=True):  # stays in cache
        # four columns side by side, one of each lane, are one word
        words = image.reshape(-1).view(np.uint64).reshape((HEIGHT, _GROUPS, _GROUP))
        for k, stored in enumerate(_columns(sub_image)):
            words[:half, :, k] = stored[:half]
            words[half:, :, k] = stored[: half - 1 : -1]
        image[:, [0, -1]] = ZERO_DN
    return made


def frame_images(sub_images: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Decode the sub-images of a frame into its images as a `RawFrame` holds them.

    They are at 16, 80 and 120 MHz, each at 0, 120 and 240 degrees: the labels of a sequence with
    `layout.SAMPLING`. ``sub_images``: 9 or more, in the order of their numbers; else as `images`.
    """
    return images(sub_images[list(IN_ORDER)])


def _columns(sub_image: NDArray[np.uint8]) -> Iterator[NDArray[np.uint64]]:
    """Yield the DN of the k-th codes of all groups (424, groups), those of four lanes a word.

    The 88 bits of a group are in the 64 from its first bit on and the 64 from bit 24 on. The array
    is the same one each time.
    """
    found = np.empty((HEIGHT, _GROUPS, _LANES), np.uint16)
    code = np.empty(found.shape, np.uint64)
    strides = (ROW_BYTES, CODE_BITS, CODE_BITS * _GROUPS)
    for first_bit, codes in ((0, range(5)), (24, range(5, _GROUP))):
        octets = np.ndarray(found.shape, "<u8", sub_image.data, first_bit // 8, strides)
        bits = np.ascontiguousarray(octets)
        for k in codes:
            np.right_shift(bits, np.uint64(CODE_BITS * k - first_bit), out=code)
            np.bitwise_and(code, np.uint64(_MASK), out=code)
            # as indices, which `take` would convert other types to
            _dn_of_code().take(code.view(np.int64), out=found, mode="clip")
            yield found.view(np.uint64)[..., 0]


def sub_images(samples: NDArray[np.floating] | NDArray[np.integer]) -> NDArray[np.uint8]:
    """Encode samples: the nearest code of each, and the saturated one beyond `LARGEST`.

    Parameters
    ----------
    samples : array, shape (N, 424, 512)
        Signed, in counts; those that are not finite are saturated. Rows as they are displayed.

    Returns
    -------
    uint8 array, shape (N, `SUB_IMAGE_BYTES`)

    Raises
    ------
    ValueError
        For samples of another shape.
    """
    if samples.shape[1:] != (HEIGHT, WIDTH):
        raise ValueError(f"samples of shape {samples.shape}, not (N, {HEIGHT}, {WIDTH})")
    packed = np.empty((len(samples), SUB_IMAGE_BYTES), np.uint8)
    for sub_image, image in zip(packed, samples, strict=True):  # one at a time stays in cache
        size = np.abs(image)
        fits = size <= LARGEST  # false for NaN
        code = _code_of_half_counts()[(2 * np.where(fits, size, 0)).astype(np.intp)]
        code[(image < 0) & (code > 0)] += _SIGN
        code[~fits] = SATURATED_CODE
        code[:, [0, -1]] = 0
        code[HEIGHT // 2 :] = code[: HEIGHT // 2 - 1 : -1].copy()
        sub_image[:] = _octets(code.reshape((HEIGHT, _GROUPS, _GROUP, _LANES)))
    return packed


def _octets(codes: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return the bytes of one sub-image of codes (424, groups, group, lanes), as stored."""
    planes = np.zeros((CODE_BITS + 1, HEIGHT, _GROUPS, _LANES), np.uint16)
    for k in range(_GROUP):
        first, shift = divmod(CODE_BITS * k, 8)
        code = codes[:, :, k]
        planes[first] |= code << shift
        planes[first + 1] |= code >> (8 - shift)
        if shift + CODE_BITS > 16:
            planes[first + 2] |= code >> (16 - shift)
    return planes[:CODE_BITS].transpose((1, 3, 2, 0)).astype(np.uint8).ravel()
