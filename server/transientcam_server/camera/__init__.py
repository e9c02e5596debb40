"""The camera and all that has it: its thread, lease, jobs and calibrations.

`Acquisition` owns the camera on a thread of its own and reports events; `LeaseManager` decides
which client may change it; `Jobs` run long work one after another; `Calibrator` is such work.
"""

from transientcam_server.camera import _lease as lease
from transientcam_server.camera._absent import NO_CAMERA, AbsentCamera, open_chosen
from transientcam_server.camera._acquisition import Acquisition, outdated
from transientcam_server.camera._calibration_store import (
    CalibrationStore,
    StoredCalibration,
    load_given,
)
from transientcam_server.camera._calibrator import CalibrationOptions, Calibrator, Drift
from transientcam_server.camera._darkness import Cause, Dark, Darkness
from transientcam_server.camera._events import (
    CameraLostEvent,
    CameraRecoveredEvent,
    Captured,
    Event,
    LightArmingEvent,
    LightOffEvent,
    OriginChanged,
    SequenceChanged,
)
from transientcam_server.camera._jobs import Job, Jobs
from transientcam_server.camera._lease import (
    DEFAULT_DURATION_S,
    MAX_DURATION_S,
    MIN_DURATION_S,
    Change,
    Lease,
    LeaseManager,
    Timer,
)
from transientcam_server.camera._light import LightGuard
from transientcam_server.camera._origin_lease import OriginLease
from transientcam_server.camera._photon_transfer import PhotonTransfer, measure_photon_transfer
from transientcam_server.camera._series import MAX_VALUES, measured, start_series
from transientcam_server.camera._shared import SharedAcquisition
from transientcam_server.camera._source import (
    LightRules,
    calibration_of,
    sensor_of,
    snapshot_of,
    start_with,
    stated_sensor,
)
from transientcam_server.camera._status import AcquisitionStatus, State
from transientcam_server.camera._supervision import Supervision
