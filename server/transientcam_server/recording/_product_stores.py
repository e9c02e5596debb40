"""Zarr stores of products that lie beside the recordings, as `transientcam reconstruct` wrote them.

Their keys are files, which are answered as they are: no Zarr library is needed to serve them. What
a client sends never becomes a path unless it is a key of the storage specification, version 3.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

FORMAT: Final = "transientcam products"
"""What the attribute ``format`` of every store and file of products is."""
SUFFIX: Final = ".zarr"
METADATA: Final = "zarr.json"
EVERY_CHUNK: Final = "every_chunk_is_written"
"""Attribute of a store: true where it is so."""
_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,127}")
_KEY: Final = re.compile(
    r"zarr\.json|[a-z]\w{0,63}/(zarr\.json|c(/(0|[1-9]\d{0,9})){0,8})", re.ASCII
)
_METADATA_BYTES: Final = 4 * 1024**2
"""Of a group with consolidated metadata, at most: those of 20 products take 30 KB."""


@dataclass(frozen=True, slots=True)
class ProductStore:
    """A store, as its metadata describe it.

    Attributes
    ----------
    id
        Name of its directory, without the suffix.
    recording_id, title
        Of the recording whose products these are.
    products
        Names.
    bins
        Times of flight of products over time.
    reconstruction
        Settings that they were computed with.
    complete
        Whether all frames are in it.
    generation
        Names what it holds: another one of the same id has another.
    has_every_chunk
        Whether also chunks of the fill value alone are written, so that one that is not there was
        deleted.
    """

    id: str
    path: Path
    recording_id: str
    title: str
    products: tuple[str, ...]
    bins: int
    frames: int
    reconstruction: Mapping[str, Any]
    complete: bool
    generation: str
    has_every_chunk: bool

    @property
    def state(self) -> Literal["complete", "unfinished"]:
        """Whether all frames are in it, in a word."""
        return "complete" if self.complete else "unfinished"

    def file(self, key: str) -> Path | None:
        """Return the file that stands at a key, such as ``range/c/3/0/0``; None without one.

        A chunk without a file has the fill value in all places, by Zarr's rules, if
        `may_be_left_out`.
        """
        if not _KEY.fullmatch(key):
            return None
        path = self.path / key
        # links may lead elsewhere, and are followed only within the store
        inside = path.resolve().is_relative_to(self.path.resolve())
        return path if inside and path.is_file() else None

    def may_be_left_out(self, key: str) -> bool:
        """Return whether a reader may take the chunk at a key for one of the fill value."""
        array, _, numbers = key.partition("/c")
        if self.has_every_chunk:
            return False
        try:
            document = _document(self.path / array / METADATA)
            shape, chunks = document["shape"], document["chunk_grid"]["configuration"]
            counts = map(lambda size, chunk: -(-size // chunk), shape, chunks["chunk_shape"])
            wanted = [int(each) for each in numbers.split("/")[1:]]
            return len(wanted) == len(shape) and all(map(int.__lt__, wanted, counts))
        except (OSError, ValueError, TypeError, KeyError, ZeroDivisionError):
            return False


class ProductStores:
    """The stores in a directory, found anew by each call; its methods wait for the disk."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def all(self) -> list[ProductStore]:
        """Return all stores, by their ids."""
        try:
            entries = sorted(self._directory.iterdir())
        except OSError:
            return []
        found = (_read(path) for path in entries if path.name.endswith(SUFFIX))
        return [store for store in found if store is not None]

    def find(self, store_id: str) -> ProductStore | None:
        """Return a store by its id, None if there is none.

        Behind the id ``~`` and the `generation` may stand, of which it then is.
        """
        name, _, generation = store_id.partition("~")
        if not _ID.fullmatch(name):
            return None
        found = _read(self._directory / (name + SUFFIX))
        return None if found and generation not in ("", found.generation) else found


def _read(path: Path) -> ProductStore | None:
    """Return the store in a directory; None where there is none, or one of something else."""
    store_id = path.name.removesuffix(SUFFIX)
    if not _ID.fullmatch(store_id) or path.is_symlink():
        return None
    try:
        group = _document(path / METADATA)
        attributes = group["attributes"]
        if attributes["format"] != FORMAT:
            return None
        *products, bins = json.loads(attributes["products"])
        consolidated = group.get("consolidated_metadata")
        arrays = {} if consolidated is None else consolidated["metadata"]
        counting = arrays.get("frame") or _document(path / "frame" / METADATA)
        return ProductStore(
            id=store_id,
            path=path,
            recording_id=str(attributes["recording_id"]),
            title=str(attributes["title"]),
            products=tuple(map(str, products)),
            bins=int(bins),
            frames=int(counting["shape"][0]),
            reconstruction=dict(json.loads(attributes["reconstruction"])),
            complete=consolidated is not None,
            generation=hashlib.sha256(json.dumps(group).encode()).hexdigest()[:12],
            has_every_chunk=attributes.get(EVERY_CHUNK) is True,
        )
    except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError):
        return None  # it is being laid out, or is no store that `reconstruct` wrote


def _document(path: Path) -> Any:
    if not path.is_file():  # opening a pipe would wait
        raise FileNotFoundError(path)
    with path.open("rb") as file:
        return json.loads(file.read(_METADATA_BYTES))
