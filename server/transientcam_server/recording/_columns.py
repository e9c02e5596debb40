"""What a recording says of its images, as columns and texts that every other format carries."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from transientcam_server.imaging import Column, image_columns, moment_columns
from transientcam_server.recording import _layout as layout
from transientcam_server.recording._reader import Recording

AXES: Final = ("frame", "image", "y", "x")
"""Of the images."""


def columns_of(recording: Recording) -> dict[str, Column]:
    """Return everything but the images; of old files what follows from their sequence."""
    header, labels = recording.header, recording.labels
    columns = {
        name: Column(("frame",), recording.series(name), attributes)
        for name, (_, attributes) in (layout.SERIES | layout.NUMBERS).items()
    }
    columns["captured_unix_s"] = Column(
        ("frame",),
        recording.captured_unix_s,
        {"units": "s", "long_name": "begin of the first exposure by the device's clock, Unix time"},
    )
    for name, size in zip(AXES[1:], recording.shape[1:], strict=True):
        columns[name] = Column((name,), np.arange(size, dtype=np.int32))
    columns |= image_columns(labels)
    return columns | moment_columns(header.applied, labels, header.gains)


def attributes_of(recording: Recording) -> dict[str, str]:
    """Return name, sequence, settings and all other documents of a recording as texts."""
    header = recording.header
    return {
        "title": header.name,
        "Conventions": "CF-1.11",
        "recording_id": header.recording_id,
        "started_s": repr(header.started_s),
        "sequence": json.dumps(header.applied.to_document()),
        "capabilities": json.dumps(asdict(header.capabilities)),
        "camera": json.dumps(dict(header.camera)),
        "calibration": json.dumps(dict(header.calibration)),
        "reconstruction": json.dumps(dict(header.reconstruction)),
        "versions": json.dumps(dict(header.versions)),
        "annotations": json.dumps(recording.annotations),
        "end": json.dumps(recording.end),
    }


def as_json(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as JSON can carry them."""
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in attributes.items()
    }
