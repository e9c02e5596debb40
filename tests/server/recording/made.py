"""Recordings for tests: small frames of any values, and the header that goes with them."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from transientcam_driver import Capabilities, RawFrame, Sequence, open_camera
from transientcam_driver.camera import Sensor
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording import Header, RecordingWriter

WIDTH, HEIGHT = 16, 12
SEQUENCE = Sequence(harmonics=2, zeroth="estimated", exposure_s=1e-3)
_SIZE = {"width": WIDTH, "height": HEIGHT}


def capabilities() -> Capabilities:
    """Those of the simulated camera, with a smaller sensor."""
    with open_camera("sim:mirrors?noise=off", clock=VirtualClock()) as camera:
        theirs = camera.capabilities
    values = {each.name: getattr(theirs, each.name) for each in fields(Capabilities)}
    return Capabilities(**(values | _SIZE))


CAPABILITIES = capabilities()
APPLIED = CAPABILITIES.apply(SEQUENCE, epoch=7)


def header(**changes: Any) -> Header:
    """A header that says something in every field."""
    values: dict[str, Any] = {
        "recording_id": "20261120T081500Z-3f9c2a",
        "name": "Möbius strip, 3 m",
        "started_s": 1795161600.25,
        "applied": APPLIED,
        "capabilities": CAPABILITIES,
        "camera": {"spec": "sim:mirrors", "scene": "mirrors", "sensor": asdict(Sensor())},
        "calibration": {"id": "nominal"},
        "reconstruction": {"bias": 0.004},
    }
    return Header(**(values | changes))


def frame(number: int, *, seed: int = 0) -> RawFrame:
    """A frame whose pixels and figures follow from its number."""
    rng = np.random.default_rng((seed, number))
    labels = APPLIED.labels
    return RawFrame(
        number=number,
        epoch=APPLIED.epoch,
        images=rng.integers(0, 4096, (len(labels), HEIGHT, WIDTH), dtype=np.uint16),
        labels=labels,
        device_time_s=0.1 * number,
        host_time_s=1795161600.25 + 0.1 * number,
        capture_s=float(rng.uniform(0.01, 0.1)),
        temperature_c=float(rng.uniform(20.0, 40.0)),
        lost_images=int(rng.integers(0, 3)),
    )


def assert_same(got: RawFrame, wanted: RawFrame) -> None:
    """Hold two frames against each other, bit for bit."""
    for each in fields(RawFrame):
        if each.name == "images":
            assert got.images.dtype == np.uint16
            np.testing.assert_array_equal(got.images, wanted.images)
        elif each.name != "captured_unix_s":  # which follows from the other times of all frames
            assert getattr(got, each.name) == getattr(wanted, each.name), each.name


def record(
    path: Path, frames: int, *, annotations: Mapping[str, Any] | None = None, **changes: Any
) -> Path:
    """Make a whole recording."""
    writer = RecordingWriter(path, header(**changes), annotations=annotations)
    for number in range(frames):
        writer.append(frame(number))
    writer.close({"reason": "stopped", "frames": frames, "duration_s": 0.1 * frames})
    return path


def rewrite_texts_at_the_end(path: Path) -> None:
    """Rewrite the texts of a recording behind 3 MiB of data; its title is another then."""
    with h5py.File(path, "r+") as file:
        file["padding"] = np.random.default_rng(0).integers(256, size=3 * 1024**2, dtype=np.uint8)
        texts = {name: value for name, value in file.attrs.items() if isinstance(value, str)}
        for name, value in texts.items():
            del file.attrs[name]
            file.attrs[name] = value
        file.attrs["title"] = "rewritten"
