"""A camera in this process: an AMCW lidar, or its simulation behind the same cable.

>>> from transientcam_driver import Sequence, open_camera
>>> with open_camera("sim:mirrors") as camera:
...     applied = camera.configure(Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3))
...     camera.start()
...     frame = camera.read_frame(timeout_s=5.0)
>>> frame.images.shape
(12, 120, 163)
"""

from transientcam_driver.calibration import (
    CalibrationCapture,
    CalibrationSubject,
    capture_calibration,
)
from transientcam_driver.camera import Camera, CameraState
from transientcam_driver.capabilities import AppliedSequence, Capabilities
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
from transientcam_driver.factory import FactoryCalibration, Lens
from transientcam_driver.handle import Simulation, Truth
from transientcam_driver.opening import open_camera
from transientcam_driver.plugin import CameraName, CameraPlugin, FoundCamera
from transientcam_driver.protocol import Status
from transientcam_driver.receiving import Counters, RawFrame
from transientcam_driver.sampling import Sampling
from transientcam_driver.sequence import ImageLabel, Sequence, SubPhases
from transientcam_driver.simulation import SceneInfo, list_scenes
from transientcam_driver.triggered import TriggeredCamera, TriggeredDevice

__all__ = [
    "AppliedSequence",
    "CalibrationCapture",
    "CalibrationError",
    "CalibrationFileError",
    "CalibrationMismatch",
    "CalibrationSubject",
    "Camera",
    "CameraBusy",
    "CameraClosed",
    "CameraError",
    "CameraFault",
    "CameraLost",
    "CameraName",
    "CameraNotFound",
    "CameraPlugin",
    "CameraState",
    "CameraUnreachable",
    "Capabilities",
    "CompilerMissing",
    "Counters",
    "DeviceRefused",
    "DriverError",
    "EffectError",
    "FactoryCalibration",
    "FirmwareTooOld",
    "FoundCamera",
    "FrameTimeout",
    "ImageLabel",
    "ImagesLost",
    "Lens",
    "LibusbMissing",
    "NotStreaming",
    "PermissionDenied",
    "PluginError",
    "ProtocolError",
    "RawFrame",
    "Sampling",
    "SceneError",
    "SceneInfo",
    "Sequence",
    "SequenceError",
    "Simulation",
    "SpecError",
    "Status",
    "SubPhases",
    "TriggeredCamera",
    "TriggeredDevice",
    "Truth",
    "capture_calibration",
    "list_scenes",
    "open_camera",
]
