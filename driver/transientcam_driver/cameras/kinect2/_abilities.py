"""What every Kinect v2 can do: one sequence, which nothing changes."""

from typing import Final

from transientcam_driver.camera import Capabilities
from transientcam_driver.cameras.kinect2._codes import BITS, ZERO_DN
from transientcam_driver.cameras.kinect2._device import Identity
from transientcam_driver.cameras.kinect2._layout import (
    BASE_FREQUENCY_HZ,
    HEIGHT,
    MEASURED,
    SAMPLING,
    WIDTH,
)

FRAME_RATE_HZ: Final = 30
IMAGE_PERIOD_S: Final = 1 / (FRAME_RATE_HZ * MEASURED)
EXPOSURE_S: Final = round(IMAGE_PERIOD_S / 2, 9)
"""An assumption: how a thirtieth of a second is divided into exposures is not known."""
MOST_TAKES: Final = 16


def capabilities_of(identity: Identity) -> Capabilities:
    """Return them with the name of one camera."""
    return Capabilities(
        model="Kinect v2", serial=identity.serial, firmware=identity.firmware, protocol_version=1,
        width=WIDTH, height=HEIGHT, bits=BITS, readout_s=IMAGE_PERIOD_S - EXPOSURE_S,
        streaming_readout_s=IMAGE_PERIOD_S - EXPOSURE_S, tuning_step_hz=1.0,
        min_frequency_hz=BASE_FREQUENCY_HZ,
        max_frequency_hz=BASE_FREQUENCY_HZ * SAMPLING.multiples[-1],
        max_harmonics=len(SAMPLING.multiples), min_exposure_s=EXPOSURE_S, max_exposure_s=EXPOSURE_S,
        max_takes=MOST_TAKES, sampling=SAMPLING, dark_dn=float(ZERO_DN),
    )  # fmt: skip
