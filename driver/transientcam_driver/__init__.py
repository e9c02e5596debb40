"""A camera in this process: an AMCW lidar, or its simulation behind the same cable.

>>> from transientcam_driver import Sequence, open_camera
>>> with open_camera("sim:mirrors") as camera:
...     applied = camera.configure(Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3))
...     camera.start()
...     frame = camera.read_frame(timeout_s=5.0)
>>> frame.images.shape
(12, 120, 163)
"""

from typing import TYPE_CHECKING, Any

from transientcam_driver.calibration import (
    CalibrationCapture,
    CalibrationSubject,
    capture_calibration,
)
from transientcam_driver.camera import (
    AppliedSequence,
    Camera,
    CameraName,
    CameraPlugin,
    CameraState,
    Capabilities,
    Counters,
    Extrinsics,
    FactoryCalibration,
    FoundCamera,
    Lens,
    RawFrame,
    Sensor,
    Simulation,
    Status,
    Truth,
    open_camera,
)
from transientcam_driver.cameras.free_running import (
    Capture,
    Description,
    Exposure,
    FreeRunningCamera,
    FreeRunningDevice,
    Moment,
)
from transientcam_driver.cameras.triggered import TriggeredCamera, TriggeredDevice
from transientcam_driver.errors import (
    CalibrationError,
    CalibrationFileError,
    CalibrationMismatch,
    CameraBusy,
    CameraClosed,
    CameraError,
    CameraFault,
    CameraLost,
    CameraNotFound,
    CameraUnreachable,
    CompilerMissing,
    DeviceRefused,
    DriverError,
    EffectError,
    FirmwareTooOld,
    FrameTimeout,
    ImagesLost,
    LibusbMissing,
    NotStreaming,
    PermissionDenied,
    PluginError,
    ProtocolError,
    SceneError,
    SequenceError,
    SpecError,
)
from transientcam_driver.sequence import ImageLabel, Sampling, Sequence, SubPhases

if TYPE_CHECKING:
    from transientcam_simulation import SceneInfo, list_scenes

__all__ = [
    "AppliedSequence", "CalibrationCapture", "CalibrationError", "CalibrationFileError",
    "CalibrationMismatch", "CalibrationSubject", "Camera", "CameraBusy", "CameraClosed",
    "CameraError", "CameraFault", "CameraLost", "CameraName", "CameraNotFound", "CameraPlugin",
    "CameraState", "CameraUnreachable", "Capabilities", "Capture", "CompilerMissing", "Counters",
    "Description", "DeviceRefused", "DriverError", "EffectError", "Exposure", "Extrinsics",
    "FactoryCalibration", "FirmwareTooOld", "FoundCamera", "FrameTimeout", "FreeRunningCamera",
    "FreeRunningDevice", "ImageLabel", "ImagesLost", "Lens", "LibusbMissing", "Moment",
    "NotStreaming", "PermissionDenied", "PluginError", "ProtocolError", "RawFrame", "Sampling",
    "SceneError", "SceneInfo", "Sensor", "Sequence", "SequenceError", "Simulation", "SpecError",
    "Status", "SubPhases", "TriggeredCamera", "TriggeredDevice", "Truth", "capture_calibration",
    "list_scenes", "open_camera",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import the names of the simulation when asked for: it stands above the driver."""
    if name in {"SceneInfo", "list_scenes"}:
        import transientcam_simulation

        return getattr(transientcam_simulation, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
