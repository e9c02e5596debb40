"""The state of the acquisition, as the API and the service manager report it."""

from dataclasses import dataclass
from typing import Literal

from transientcam_server.camera._darkness import Cause

State = Literal["arming", "starting", "streaming", "stopped", "calibrating", "lost"]


@dataclass(frozen=True, slots=True)
class AcquisitionStatus:
    """State and rate of the acquisition, as `AcquisitionDocument` says of each field.

    ``state`` is ``streaming`` also before the first frame, ``stopped`` until somebody starts, and
    ``calibrating`` while a calibration has exclusive use of the camera.
    """

    state: State
    running: bool
    rate_hz: float | None
    frames: int
    frame_age_s: float
    reason: str | None
    stalled: bool
    offs: int
    light_on_in_s: float | None = None
    off_because: Cause | None = None
    off_kept: bool | None = None
    switching_off: bool = False

    @property
    def obstacles(self) -> list[str]:
        """Why no frames can be had; empty where they can."""
        reasons = []
        if self.state == "lost":
            reasons.append(f"the camera is lost: {self.reason}")
        if self.state == "arming":
            reasons.append("the light is announced and not on yet")
        if self.state in ("starting", "streaming") and not self.frames:
            reasons.append("the camera is starting")
        if self.state in ("starting", "streaming") and self.reason:
            reasons.append(self.reason)
        if self.stalled:
            reasons.append(f"no frame arrived for {self.frame_age_s:.1f} s")
        return reasons

    @property
    def obstacle(self) -> str:
        """Why no frames come, and what helps; empty where they come or may soon."""
        if self.state == "stopped":
            why = self.reason or "nothing is captured"
            return f'{why} (PUT /api/v1/acquisition {{"running": true}} starts it)'
        if self.state == "calibrating":
            return "a calibration is measured"
        return "; ".join(self.obstacles)
