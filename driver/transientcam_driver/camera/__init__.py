"""What a camera is: its interface, its values, its limits, and the plug-ins that open one.

Programs use a `Camera`. `Status`, `RawFrame` and `Counters` are plain values of any device.
`HostCamera` is the base of cameras whose state is kept on this machine. A package offers a
`CameraPlugin`; `open_camera` opens a camera by its name.
"""

from transientcam_driver.camera._camera import Camera, CameraState, has_light, light_warning
from transientcam_driver.camera._capabilities import (
    IMAGE_HEADER_BYTES,
    AppliedSequence,
    Capabilities,
)
from transientcam_driver.camera._capture_clock import CaptureClock, capture_times
from transientcam_driver.camera._factory import Extrinsics, FactoryCalibration, Lamp, Lens
from transientcam_driver.camera._frame import Counters, Hop, RawFrame
from transientcam_driver.camera._host_camera import HostCamera
from transientcam_driver.camera._opening import check_camera, kinds, open_camera, plugin_of
from transientcam_driver.camera._plugged import Plugged, SameDevice, listed, place_on
from transientcam_driver.camera._plugin import CameraName, CameraPlugin, FoundCamera
from transientcam_driver.camera._sensor import Sensor
from transientcam_driver.camera._simulation import (
    ExplainedEffect,
    Explanation,
    Response,
    Simulation,
    SurfaceSeen,
    Truth,
)
from transientcam_driver.camera._stated import finite, require, require_image, require_stated
from transientcam_driver.camera._status import DeviceState, Status, StatusFlag
