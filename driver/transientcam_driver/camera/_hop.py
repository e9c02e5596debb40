"""One relay that a frame came through."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Hop:
    """What one relay adds to a frame.

    Attributes
    ----------
    service_id
        Which service relayed it.
    latency_s
        From its arrival at the service before to its arrival here, by the clocks of both machines.
    missed_frames
        Frames that the service before had and this one never got, since this one was opened.
    """

    service_id: str
    latency_s: float
    missed_frames: int
