"""Recordings of the simulated camera, as quick as it computes."""

from dataclasses import replace
from pathlib import Path

from transientcam_driver import AppliedSequence, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording import Header, RecordingWriter


def record(
    path: Path, camera: str, sequence: Sequence, frames: int, *, distinct: int
) -> AppliedSequence:
    """Record so many frames, of which so many are simulated and the others repeat them."""
    with open_camera(camera, clock=VirtualClock()) as opened:
        applied = opened.configure(sequence)
        opened.start()
        simulated = [opened.read_frame() for _ in range(min(frames, distinct))]
        header = Header(path.stem, path.stem, 1e9, applied, opened.capabilities)
    writer = RecordingWriter(path, header)
    for number in range(frames):
        writer.append(replace(simulated[number % len(simulated)], number=number + 1))
    writer.close({})
    return applied
