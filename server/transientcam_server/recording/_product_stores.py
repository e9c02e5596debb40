"""Zarr stores of products that lie beside the recordings, as `transientcam reconstruct` wrote them.

Their keys are files, which are answered as they are: no Zarr library is needed to serve them. What
a client sends never becomes a path unless it is a key of the storage specification, version 3.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final, Literal

from transientcam_server.errors import fenced

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
_MOST_PRODUCTS: Final = 64
_MOST_CHARACTERS: Final = 64 * 1024
_DIGITS: Final = 18


@dataclass(frozen=True, slots=True)
class ProductStore:
    """A store, as its metadata describe it."""

    id: str
    """Name of its directory, without the suffix."""
    path: Path
    recording_id: str
    title: str
    """``recording_id``, ``title``: of the recording whose products these are."""
    products: tuple[str, ...]
    """Names."""
    bins: int
    """Times of flight of products over time."""
    frames: int
    reconstruction: Mapping[str, Any]
    """Settings that they were computed with."""
    complete: bool
    """Whether all frames are in it."""
    generation: str = ""
    """Names what it holds: another one of the same id has another."""
    has_every_chunk: bool = False
    """Whether also chunks of the fill value alone are written, so that one that is not there was
    deleted."""
    problem: str | None = None
    """Why it cannot be read; None where it can, else all that is above is empty."""

    @property
    def state(self) -> Literal["complete", "unfinished", "damaged"]:
        """Whether all frames are in it, in a word."""
        if self.problem is not None:
            return "damaged"
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
        """Return a store by its id, None if there is none that can be read.

        Behind the id ``~`` and the `generation` may stand, of which it then is.
        """
        name, _, generation = store_id.partition("~")
        if not _ID.fullmatch(name):
            return None
        found = _read(self._directory / (name + SUFFIX))
        if found is None or found.problem is not None:
            return None
        return None if generation not in ("", found.generation) else found


def _read(path: Path) -> ProductStore | None:
    """Return the store in a directory; None where there is none, or one of something else."""
    if not _ID.fullmatch(_id_of(path)) or path.is_symlink():
        return None
    return fenced(
        _described,
        path,
        lambda reason: ProductStore(
            _id_of(path), path, "", "", (), 0, 0, {}, False, problem=reason
        ),
    )


def _described(path: Path) -> ProductStore | None:
    try:
        group = _document(path / METADATA)
    except FileNotFoundError:
        return None  # it is being laid out
    attributes = group.get("attributes", {})
    if attributes.get("format") != FORMAT:
        return None
    *products, bins = _parsed(_text(attributes, "products"))
    consolidated = group.get("consolidated_metadata")
    arrays = {} if consolidated is None else consolidated["metadata"]
    counting = arrays.get("frame") or _document(path / "frame" / METADATA)
    if len(products) > _MOST_PRODUCTS or not all(isinstance(each, str) for each in products):
        raise ValueError(f"products: must be at most {_MOST_PRODUCTS} names")
    return ProductStore(
        id=_id_of(path),
        path=path,
        recording_id=_text(attributes, "recording_id"),
        title=_text(attributes, "title"),
        products=tuple(products),
        bins=_count("bins", bins),
        frames=_count("frames", counting["shape"][0]),
        reconstruction=dict(_parsed(_text(attributes, "reconstruction"))),
        complete=consolidated is not None,
        generation=hashlib.sha256(json.dumps(group).encode()).hexdigest()[:12],
        has_every_chunk=attributes.get(EVERY_CHUNK) is True,
    )


def _id_of(path: Path) -> str:
    return path.name.removesuffix(SUFFIX)


def _document(path: Path) -> Any:
    if not path.is_file():  # opening a pipe would wait
        raise FileNotFoundError(path)
    with path.open("rb") as file:
        document = _parsed(file.read(_METADATA_BYTES))
    if not isinstance(document, dict):
        raise ValueError(f"{path.name}: must be a JSON object")
    return document


def _parsed(text: str | bytes) -> Any:
    """Return a JSON document that can be written as one again: of finite numbers alone."""
    return json.loads(text, parse_constant=_no_number, parse_int=_integer, parse_float=_finite)


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _finite(text: str) -> float:
    return value if isfinite(value := float(text)) else _no_number(text[:20])


def _integer(text: str) -> int:
    if len(text) > _DIGITS:
        raise ValueError(f"a number of {len(text)} digits")
    return int(text)


def _text(attributes: Mapping[str, Any], name: str) -> str:
    value = attributes[name]
    if not isinstance(value, str) or len(value) > _MOST_CHARACTERS:
        raise ValueError(f"{name}: must be a text of at most {_MOST_CHARACTERS} characters")
    return value


def _count(name: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**31:
        raise ValueError(f"{name}: must be a whole number from 0 to {2**31 - 1}")
    return value
