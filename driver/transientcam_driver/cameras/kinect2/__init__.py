"""Microsoft Kinect v2: three fixed frequencies over USB 3 (docs/cameras.md, docs/kinect2.md).

``packets`` finds sub-images in the packets of the isochronous endpoint, ``codes`` decodes them
into the images of a frame, ``tables`` and ``parameters`` read what the camera knows about itself;
``encoder`` goes the other way. All of these are pure. The bytes are
those that OpenKinect/libfreenect2 accepts.
"""

from transientcam_driver.cameras.kinect2 import _codes as codes, _encoder as encoder
from transientcam_driver.cameras.kinect2._abilities import (
    EXPOSURE_S,
    FRAME_RATE_HZ,
    IMAGE_PERIOD_S,
    capabilities_of,
)
from transientcam_driver.cameras.kinect2._camera import Kinect2Camera
from transientcam_driver.cameras.kinect2._codes import BITS, ZERO_DN
from transientcam_driver.cameras.kinect2._commands import (
    COLOR_PARAMETERS_BYTES,
    COMPLETION_MAGIC,
    INITIALISE_STREAMS,
    MODE_OFF,
    MODE_ON,
    MODE_ON_PLAIN,
    READ_COLOR_PARAMETERS,
    READ_FIRMWARE_VERSIONS,
    READ_HARDWARE,
    READ_P0,
    READ_PARAMETERS,
    READ_SERIAL,
    READ_STATUS,
    REQUEST_MAGIC,
    STOP,
    STREAMING_OFF,
    STREAMING_ON,
    Request,
)
from transientcam_driver.cameras.kinect2._device import Identity, Kinect2
from transientcam_driver.cameras.kinect2._finding import PRODUCT, SameKinect, facts, list_kinects
from transientcam_driver.cameras.kinect2._layout import (
    BASE_FREQUENCY_HZ,
    HEIGHT,
    IN_ORDER,
    MEASURED,
    PHASES,
    SAMPLING,
    STREAM_MULTIPLES,
    SUB_IMAGE_BYTES,
    SUB_IMAGES,
    WIDTH,
)
from transientcam_driver.cameras.kinect2._link import (
    PRODUCT_IDS,
    VENDOR_ID,
    FailureTaker,
    PacketTaker,
)
from transientcam_driver.cameras.kinect2._packets import TICK_S, Assembler
from transientcam_driver.cameras.kinect2._parameters import ROWS, DepthParameters, Rows
from transientcam_driver.cameras.kinect2._tables import RESPONSE_BYTES, P0Tables
from transientcam_driver.cameras.kinect2._usb_link import LEAST_TRANSFERS, PACKETS, TRANSFERS
from transientcam_driver.cameras.kinect2._usb_port import PACKET_BYTES, UDEV_RULES, libusb
