"""Checks of a running camera against the documentation: each tries one promise of it.

``transientcam conformance URL`` runs them. They use nothing but the documented interface, and
leave the camera as they found it.
"""

from transientcam_conformance._device import Device
from transientcam_conformance._running import (
    CHECKS,
    GROUPS,
    SLOW,
    Check,
    Report,
    Result,
    chosen,
    run,
)
