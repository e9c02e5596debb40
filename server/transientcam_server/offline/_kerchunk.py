"""References into a recording's file, by which Zarr readers read it where it lies, as on S3.

The format is version 1 of kerchunk's references: fsspec has a file system for it (``reference``),
xarray an engine with the package kerchunk installed. It names the stored chunks by offset and size.
"""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from transientcam_server.errors import InputError
from transientcam_server.offline._formats import whole
from transientcam_server.recording import Recording, ZarrKeys


def write_references(
    output: Path, recording: Recording, url: str | None, progress: Callable[[int, int], None]
) -> None:
    """Write the references of a recording as JSON.

    ``url``: where readers find the recording; None for the file that it was read from.
    Raises InputError if its images are not in chunks, or the file is not finished.
    Raises DamagedFrame if a chunk is not where the file says.
    Raises FileExistsError if the output is there already.
    Raises OSError if the output cannot be written.
    """
    file, keys = recording.path, ZarrKeys(recording)
    if file.name.endswith(".part"):
        raise InputError(str(file), "its name", "that of an unfinished file", "of a finished one")
    if recording.stored.chunks is None:
        raise InputError(str(file), "raw", "stored in one piece", "stored in chunks")
    references: dict[str, Any] = {
        key: json.dumps(document) for key, document in keys.metadata.items()
    }
    for key in keys.small():
        references[key] = "base64:" + base64.b64encode(keys.value(key)).decode("ascii")
    for key, place in keys.places():
        references[key] = ["{{u}}", place.offset_bytes, place.size_bytes]
        progress(int(key.partition("/")[2].partition(".")[0]) + 1, recording.frames)
    templates = {"u": url or file.resolve().as_uri()}
    with whole(output) as scratch:
        document = {"version": 1, "templates": templates, "refs": references}
        scratch.write_text(json.dumps(document), encoding="ascii")
