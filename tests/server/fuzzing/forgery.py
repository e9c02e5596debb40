"""Recordings rewritten by h5py: wrong types, shapes, places and values."""

import json
import random
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from isal import isal_zlib

BOMB_BYTES: Final = 512 * 1024**2
_TEXTS: Final = ("", "x", "\ud800", "\0", "nominal", "9" * 5000, "é" * 3000)
_NUMBERS: Final = (
    0,
    -1,
    1,
    2,
    3,
    7,
    2**31,
    2**63,
    2**64,
    10**12,
    10**400,
    0.5,
    -0.0,
    1e-320,
    1e308,
)
_STRANGE: Final[tuple[Any, ...]] = (None, True, [], {}, [1], {"a": 1}, float("nan"), float("inf"))
_DOCUMENTS: Final = (
    "sequence",
    "capabilities",
    "camera",
    "calibration",
    "reconstruction",
    "versions",
)
_SERIES: Final = (
    "epoch", "device_time_s", "host_time_s", "capture_s", "temperature_c", "lost_images",
    "dropped_frames", "crc32", "device_frame", "frame",
)  # fmt: skip
_LABELS: Final = ("take", "harmonic", "frequency_hz", "phase_rad", "exposure_s", "illumination")
_TYPES: Final = (
    "u1", "<u2", ">u2", "<i4", "<i8", "<u8", "<f4", "<f8", ">f8", "<c8", "?", "S7", "S16384",
    h5py.string_dtype(), h5py.ref_dtype, h5py.vlen_dtype("i4"), h5py.enum_dtype({"a": 0}),
    np.dtype([("a", "<i4"), ("b", "S3")]), h5py.opaque_dtype(np.dtype("M8[s]")),
)  # fmt: skip
Forge = Callable[[Any, random.Random, Path], None]


def nested(levels: int) -> Any:
    """Return lists in lists."""
    value: Any = []
    for _ in range(levels):
        value = [value]
    return value


def any_value(draw: random.Random) -> Any:
    """Return something that JSON, as Python writes it, can hold."""
    kind = draw.randrange(4)
    if kind == 0:
        return draw.choice(_TEXTS)
    if kind == 1:
        return draw.choice(_NUMBERS)
    return draw.choice(_STRANGE) if kind == 2 else nested(draw.choice((1, 60, 70, 300, 900)))


def changed_document(document: Any, draw: random.Random) -> Any:
    """Return a JSON document with one value replaced, taken away or added, at any depth."""
    if not isinstance(document, dict) or not document or draw.random() < 0.1:
        return any_value(draw)
    changed = dict(document)
    key = draw.choice(list(changed))
    action = draw.randrange(4)
    if action == 0:
        del changed[key]
    elif action == 1:
        changed[draw.choice(_TEXTS)] = any_value(draw)
    elif action == 2:
        changed[key] = any_value(draw)
    else:
        changed[key] = changed_document(changed[key], draw)
    return changed


def dumped(document: Any) -> str:
    """Return JSON, as long as an attribute may be."""
    try:
        return json.dumps(document)[:60_000]
    except (RecursionError, ValueError):  # an int of too many digits
        return "[" * 2000


def document_of(file: Any, draw: random.Random, place: Path) -> None:
    """Change one of the JSON attributes."""
    name = draw.choice(_DOCUMENTS)
    if draw.random() < 0.1:
        file.attrs[name] = draw.choice(("", "{", "[" * 50_000, "null", '{"a":1e999}', "\udc80"))
    else:
        file.attrs[name] = dumped(changed_document(json.loads(file.attrs[name]), draw))


def attribute(file: Any, draw: random.Random, place: Path) -> None:
    """Replace or remove an attribute."""
    name = draw.choice(list(file.attrs))
    if draw.random() < 0.2:
        del file.attrs[name]
        return
    value = draw.choice(
        (1, 2.5, np.nan, np.inf, -1, 2**62, b"bytes", "text", [1, 2], ["a", "b"], True,
         np.zeros((2, 2)), h5py.Empty("f"), np.void(b"abc"), "\udcff", "x" * 60_000)
    )  # fmt: skip
    file.attrs[name] = value


def text(file: Any, draw: random.Random, place: Path) -> None:
    """Change how it ended, or what was written about it."""
    name = draw.choice(("end", "annotations"))
    before = json.loads(bytes(file[name][()]) or b"{}")
    size = file[name].dtype.itemsize
    written = dumped(changed_document(before, draw)).encode("utf-8", "surrogatepass")
    file[name][()] = written[:size]


def values(file: Any, draw: random.Random, place: Path) -> None:
    """Put extreme values into a series or a column of labels."""
    name = draw.choice((*_SERIES, *_LABELS))
    dataset = file[name]
    if not len(dataset):
        return
    kind = dataset.dtype
    extremes: list[Any] = [0, 1]
    if kind.kind == "f":
        extremes += [np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324]
    else:
        extremes += [np.iinfo(kind).max, np.iinfo(kind).min]
    dataset[draw.randrange(len(dataset))] = np.asarray(draw.choice(extremes)).astype(kind)


def missing(file: Any, draw: random.Random, place: Path) -> None:
    """Remove a dataset."""
    del file[draw.choice(list(file))]


def kind_of(file: Any, draw: random.Random, place: Path) -> None:
    """Replace a dataset by a group or a link."""
    name = draw.choice(list(file))
    del file[name]
    what = draw.randrange(5)
    if what == 0:
        file.create_group(name)
    elif what == 1:
        file[name] = h5py.SoftLink(draw.choice(("/raw", "/nowhere", f"/{name}")))
    elif what == 2:
        file[name] = h5py.ExternalLink(str(place / "other.h5"), f"/{name}")
    elif what == 3:
        file[name] = file  # a loop
    else:
        file[name] = np.dtype("<f8")  # a committed type


def shape_of(file: Any, draw: random.Random, place: Path) -> None:
    """Replace a dataset by one of another type or shape, or one that only states a size."""
    name = draw.choice((*file, "calibration_planes", "calibration_bad"))
    before = file.get(name)
    shape: tuple[int, ...] = () if before is None else before.shape
    dtype: Any = "<c8" if before is None else before.dtype
    if before is not None:
        del file[name]
    if draw.random() < 0.5:
        dtype = draw.choice(_TYPES)
    if draw.random() < 0.7:
        shape = draw.choice(
            ((), (0,), (1,), (3,), (8,), (4, 12, 16), (2, 8, 12, 16), (3, 8, 12, 16), (12, 16),
             (10**6,), (10**12,), (10**5, 8, 12, 16), (3, 10**4, 10**4, 10), (1, 1, 1, 1, 1))
        )  # fmt: skip
    options: dict[str, Any] = {}
    if shape:
        options["chunks"] = tuple(min(size, 16) or 1 for size in shape)
        options["maxshape"] = tuple(draw.choice((None, size)) for size in shape)
        options["compression"] = draw.choice((None, None, "gzip", "lzf"))
        options["shuffle"] = draw.choice((False, True))
        options["fletcher32"] = draw.choice((False, False, True))
    file.create_dataset(name, shape, dtype, **options)


def elsewhere(file: Any, draw: random.Random, place: Path) -> None:
    """Store a dataset in another file: external or virtual."""
    name = draw.choice(("raw", "frame", "annotations", "end", "crc32", "phase_rad"))
    before = file[name]
    shape, dtype = before.shape, before.dtype
    del file[name]
    if draw.random() < 0.5:
        external = [(str(place / "other.h5"), 0, h5py.h5f.UNLIMITED)]
        file.create_dataset(name, shape, dtype, external=external)
        return
    layout = h5py.VirtualLayout(shape, dtype)
    if shape:
        layout[...] = h5py.VirtualSource(str(place / "other.h5"), name, shape)
    file.create_virtual_dataset(name, layout)


@cache
def bomb(size_bytes: int) -> bytes:
    """Return a deflated chunk that expands to so many bytes."""
    packing = isal_zlib.compressobj(1)
    piece = bytes(1024**2)
    return b"".join(packing.compress(piece) for _ in range(size_bytes // len(piece))) + (
        packing.flush()
    )


def chunk(file: Any, draw: random.Random, place: Path) -> None:
    """Replace the bytes of a frame: noise, another frame's, too few, or far too many."""
    raw = file["raw"]
    if not raw.chunks or raw.shape[0] < 2:
        return
    other = (draw.randrange(raw.shape[0]), 0, 0, 0)
    _, data = raw.id.read_direct_chunk(other)
    size = int(np.prod(raw.shape[1:])) * raw.dtype.itemsize
    data = draw.choice(
        (data, data[: len(data) // 2], data + b"more", b"", draw.randbytes(100),
         isal_zlib.compress(bytes(size + draw.choice((-1, 1, size)))), bomb(BOMB_BYTES))
    )  # fmt: skip
    raw.id.write_direct_chunk((draw.randrange(raw.shape[0]), 0, 0, 0), data)


def grown(file: Any, draw: random.Random, place: Path) -> None:
    """State more rows than there are."""
    for name in draw.sample(("raw", *_SERIES), draw.choice((1, 1, 5, 10))):
        rows = draw.choice((1, 10**4, 10**9, 10**12))
        # HDF5 looks for chunks one by one where rows are taken away
        if file[name].chunks and file[name].maxshape[0] is None and rows > len(file[name]):
            file[name].resize(rows, 0)


FORGERIES: Final[dict[str, Forge]] = {
    each.__name__: each
    for each in (
        document_of, attribute, text, values, missing, kind_of, shape_of, elsewhere, chunk, grown,
    )
}  # fmt: skip
"""All kinds by name."""
