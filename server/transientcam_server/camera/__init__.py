"""The camera and all that has it: its thread, lease, jobs and calibrations.

`Acquisition` owns the camera on a thread of its own and reports events; `LeaseManager` decides
which client may change it; `Jobs` run long work one after another; `Calibrator` is such work.
"""

from transientcam_server.camera.acquisition import Acquisition
from transientcam_server.camera.calibration_store import CalibrationStore
from transientcam_server.camera.calibrator import Calibrator
from transientcam_server.camera.jobs import Jobs
from transientcam_server.camera.lease import LeaseManager
from transientcam_server.camera.status import AcquisitionStatus

__all__ = [
    "Acquisition",
    "AcquisitionStatus",
    "CalibrationStore",
    "Calibrator",
    "Jobs",
    "LeaseManager",
]
