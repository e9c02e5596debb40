"""From the sub-images of a frame to images with labels."""

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2 import _codes as codes
from transientcam_driver.cameras.kinect2._layout import IN_ORDER


def images(sub_images: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the images of a frame as a `RawFrame` holds them.

    Parameters
    ----------
    sub_images : uint8 array, shape (9 or more, `SUB_IMAGE_BYTES`)
        In the order of their numbers.

    Returns
    -------
    uint16 array, shape (9, 424, 512)
        In DN, as of `codes.images`; at 16, 80 and 120 MHz, each at 0, 120 and 240 degrees: the
        labels of a sequence with `layout.SAMPLING`.

    Raises
    ------
    ValueError
        For data of another shape.
    """
    return codes.images(sub_images[list(IN_ORDER)])
