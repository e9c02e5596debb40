"""The state of the acquisition, as the API and the service manager report it."""

from dataclasses import dataclass
from typing import Literal

from transientcam_server.camera._darkness import Cause

State = Literal["arming", "starting", "streaming", "stopped", "calibrating", "lost"]


@dataclass(frozen=True, slots=True)
class AcquisitionStatus:
    """State and rate of the acquisition.

    Attributes
    ----------
    state
        ``arming`` while the light is announced; ``streaming`` also before the first frame;
        ``stopped`` until somebody starts; ``calibrating`` while a calibration has exclusive use of
        the camera.
    running
        Whether frames are to be captured.
    rate_hz
        Measured over the last frames; None before there are two.
    frames
        Captured since the start of the service.
    frame_age_s
        Since the last frame, or since the start where there was none.
    reason
        Why the camera is lost or stopped, or the light may be on.
    stalled
        Whether frames are to be captured and the camera is there, but none came for too long.
    offs
        Counts how often the light was to go off.
    light_on_in_s
        Time until the light goes on; None where none is announced.
    off_because, off_kept
        What ended the capture, or kept it from beginning, and whether that holds over a restart of
        the service; None while it is running, and of a relay.
    switching_off
        Whether the light was to go off and may be on: that is not confirmed yet.
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
        if self.stalled:
            reasons.append(f"no frame arrived for {self.frame_age_s:.1f} s")
        return reasons
