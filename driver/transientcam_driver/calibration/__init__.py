"""Calibration measurements: how a camera captures one, and the file that keeps it."""

from transientcam_driver.calibration.capture import (
    DEFAULT_TAKES,
    capture_calibration,
    mean_of_takes,
)
from transientcam_driver.calibration.file import (
    DEVICE_FIELDS,
    CalibrationCapture,
    CalibrationSubject,
)

__all__ = [
    "DEFAULT_TAKES",
    "DEVICE_FIELDS",
    "CalibrationCapture",
    "CalibrationSubject",
    "capture_calibration",
    "mean_of_takes",
]
