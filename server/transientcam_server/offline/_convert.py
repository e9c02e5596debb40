"""A recording in other formats: NumPy's .npz, netCDF's .nc, a .zarr store, an .mcap, a .json
of references into its file.

Each carries what the recording says of its images, and how they become moments.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from transientcam_server.errors import InputError
from transientcam_server.offline._formats import SINKS, Block, Content, Row, sink_of, write
from transientcam_server.offline._kerchunk import write_references
from transientcam_server.offline._mcap import Schemas, write_mcap
from transientcam_server.recording import AXES, Recording, attributes_of, columns_of

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
        write_references(output, recording, url, progress)
    else:
        write(output, content, _rows(recording, progress), sink)


def _rows(recording: Recording, progress: Progress) -> Iterator[Row]:
    for index, raw in enumerate(recording):
        yield "raw", index, raw.images
        progress(index + 1, recording.frames)
