"""What a service has recorded since it started."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import get_args

from transientcam_server.recording.recorder import Progress, Reason


@dataclass(frozen=True, slots=True)
class Totals:
    """Frames and bytes of all recordings; ``ended`` counts recordings by why they ended."""

    frames: int = 0
    dropped_frames: int = 0
    size_bytes: int = 0
    ended: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(get_args(Reason), 0))

    def with_running(self, progress: Progress) -> "Totals":
        """Return the totals together with a recording that has not ended."""
        return replace(
            self,
            frames=self.frames + progress.frames,
            dropped_frames=self.dropped_frames + progress.dropped_frames,
            size_bytes=self.size_bytes + progress.size_bytes,
        )

    def after(self, progress: Progress) -> "Totals":
        """Return the totals after a recording has ended."""
        reason = progress.reason or "failed"
        ended = {**self.ended, reason: self.ended[reason] + 1}
        return replace(self.with_running(progress), ended=ended)
