"""ESPROS TOFcam660: commands over TCP, images over UDP or TCP (docs/cameras.md).

``wire`` has the bytes, ``control`` and ``images`` the sockets, ``device`` what `TriggeredCamera`
makes a camera of. It has not been run on a device: the bytes are those that the vendor's own
client sends and accepts (epc-tofcam-toolkit 0.13.0).
"""

from transientcam_driver.cameras.tofcam660._control import ControlConnection
from transientcam_driver.cameras.tofcam660._device import (
    MAX_FREQUENCY_HZ,
    MIN_FREQUENCY_HZ,
    READOUT_S,
    SETTLE_S,
    DataOver,
    DeviceOptions,
    Tofcam660,
    offset_m,
)
from transientcam_driver.cameras.tofcam660._image import ImageHeader, PacketHeader
from transientcam_driver.cameras.tofcam660._region import COLUMNS, FULL, ROWS, Region
from transientcam_driver.cameras.tofcam660._wire import (
    CODES_FROM,
    CONTROL_PORT,
    DATA_PORT,
    DEFAULT_ADDRESS,
    HEAD_BYTES,
    LOW_AMPLITUDE,
    SATURATED,
    TAIL_BYTES,
    AnswerType,
    CalibrationEntry,
    Command,
    ImageType,
    pack_answer,
    pack_calibration,
    payload_bytes,
    require_end,
)
