"""Changes the annotations of a finished recording, and nothing else of its file."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from transientcam_server.recording import hdf5, layout


def annotate(path: Path, annotations: Mapping[str, Any]) -> None:
    """Replace the annotations, in place.

    HDF5 is not asked to: a file it has open for writing is lost if this process dies meanwhile.
    The annotations have a fixed place and size, so that their bytes can be replaced without it;
    the worst is then that the annotations themselves are torn.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If they are too long.
    """
    data = layout.encoded(annotations)
    if len(data) > layout.ANNOTATIONS_BYTES:
        raise ValueError(f"annotations of {len(data)} bytes")
    with hdf5.open_file(path, "r") as file:
        offset = file["annotations"].id.get_offset()
    if offset is None:
        raise OSError(95, "its annotations have no fixed place", str(path))
    descriptor = os.open(path, os.O_WRONLY)
    try:
        os.pwrite(descriptor, data.ljust(layout.ANNOTATIONS_BYTES, b"\0"), offset)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
