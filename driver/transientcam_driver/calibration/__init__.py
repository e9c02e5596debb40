"""Calibration measurements: how a camera captures one, and the file that keeps it."""

from transientcam_driver.calibration._capture import (
    DEFAULT_TAKES,
    capture_calibration,
    mean_of_takes,
)
from transientcam_driver.calibration._drift import TemperatureDrift
from transientcam_driver.calibration._file import (
    DEVICE_FIELDS,
    CalibrationCapture,
    CalibrationSubject,
)
from transientcam_driver.calibration._sweep import LEAST_TAKES, SWEEP_STEPS
