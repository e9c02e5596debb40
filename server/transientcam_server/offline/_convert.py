"""A recording in other formats: NumPy's .npz, netCDF's .nc, a .zarr store, an .mcap, a .json
of references into its file.

Each carries what the recording says of its images, and how they become moments.
"""

import base64
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from transientcam_server.errors import InputError
from transientcam_server.offline._formats import SINKS, Block, Content, Row, sink_of, whole, write
from transientcam_server.offline._mcap import Schemas, write_mcap
from transientcam_server.recording import AXES, Recording, ZarrKeys, attributes_of, columns_of

Progress = Callable[[int, int], None]


def convert_recording(
    recording: Recording,
    output: Path,
    *,
    products: Sequence[str] = ("raw",),
    schemas: Schemas = "foxglove",
    url: str | None = None,
    progress: Progress = lambda done, total: None,
) -> None:
    """Write a recording into ``output``, in the format of its suffix.

    ``products``: what an .mcap holds of each frame; other formats hold the raw images.
    ``schemas``: whose messages an .mcap holds.
    ``url``: where readers of a .json find the recording; None for where it is now.
    Raises NotConvertible if the suffix names none.
    Raises InputError if the format, or a message, cannot hold a product.
    Raises MissingExtra if the format's library is not installed.
    Raises DamagedFrame if a frame is not what was recorded.
    Raises FileExistsError if the output is there already.
    Raises OSError if the output cannot be written.
    """
    refers = output.suffix.lower() == ".json"
    if url is not None and not refers:
        raise InputError("--url", output.suffix, url, "left out: only a .json refers to a file")
    blocks = {"raw": Block(AXES, recording.shape, "<u2", {"units": "DN"})}
    content = Content(columns_of(recording), blocks, attributes_of(recording))
    if output.suffix.lower() == ".mcap":
        write_mcap(output, recording, content, products, schemas, progress)
        return
    sink = None
    if not refers:
        sink = sink_of(output, SINKS, what="recordings", also=[".json", ".mcap"])
    if set(products) != {"raw"}:
        raise InputError(
            "--product",
            output.suffix,
            ", ".join(products),
            "raw, or else an .mcap; transientcam reconstruct writes products into .npz, .nc, .zarr",
        )
    if sink is None:
        _write_references(output, recording, url, progress)
    else:
        write(output, content, _rows(recording, progress), sink)


def _rows(recording: Recording, progress: Progress) -> Iterator[Row]:
    for index, raw in enumerate(recording):
        yield "raw", index, raw.images
        progress(index + 1, recording.frames)


def _write_references(
    output: Path, recording: Recording, url: str | None, progress: Callable[[int, int], None]
) -> None:
    """Write the references of a recording as JSON, by which Zarr readers read it where it lies.

    The format is version 1 of kerchunk's references: fsspec has a file system for it
    (``reference``), xarray an engine with the package kerchunk installed. It names the stored
    chunks by offset and size.

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
