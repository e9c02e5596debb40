"""Checks of a running camera against the documentation: each tries one promise of it.

``transientcam conformance URL`` runs them. They use nothing but the documented interface, and
leave the camera as they found it.
"""

from transientcam.conformance.check import Check
from transientcam.conformance.device import Device
from transientcam.conformance.report import Report, Result
from transientcam.conformance.running import CHECKS, GROUPS, chosen, run

__all__ = [
    "CHECKS",
    "GROUPS",
    "Check",
    "Device",
    "Report",
    "Result",
    "chosen",
    "run",
]
