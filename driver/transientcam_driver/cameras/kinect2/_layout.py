"""What a frame of the depth stream is made of: sizes, order, frequencies (docs/kinect2.md)."""

import math
from typing import Final

from transientcam_driver.sequence import Sampling

HEIGHT: Final = 424
WIDTH: Final = 512
CODE_BITS: Final = 11
ROW_BYTES: Final = WIDTH * CODE_BITS // 8
SUB_IMAGE_BYTES: Final = HEIGHT * ROW_BYTES
SUB_IMAGES: Final = 10
MEASURED: Final = 9
"""Sub-images 0 to 8; what number 9 shows is not known (OpenKinect/libfreenect2, issue 150)."""
PHASES: Final = 3
STREAM_MULTIPLES: Final = (10, 2, 15)
"""Of 8 MHz: sub-images 0 to 2 are at 80 MHz, 3 to 5 at 16 MHz, 6 to 8 at 120 MHz."""
BASE_FREQUENCY_HZ: Final = 8e6
SAMPLING: Final = Sampling((2, 10, 15), tuple(2 * math.pi * k / PHASES for k in range(PHASES)))
"""The frequencies ascending; each of them at 0, 120 and 240 degrees."""
ASCENDING: Final = tuple(STREAM_MULTIPLES.index(each) for each in SAMPLING.multiples)
"""Which frequency of the stream is the k-th one of `SAMPLING`."""
# image k of a frequency is Re(b exp(+2 pi i k / 3)), a label's Re(b exp(-i phase)): k = 0, 2, 1
IN_ORDER: Final = tuple(PHASES * place + k for place in ASCENDING for k in (0, 2, 1))
"""Which sub-image is the k-th one of a `RawFrame`, in the order of its labels."""
RESPONSE: Final = (1 / 1.322581, 1.0, 1 / 1.612903)
"""Amplitude of a sample over that of the light, at 80, 16 and 120 MHz."""
