"""The fence around files of others: whatever one holds, it hurts nothing but itself."""

from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from transientcam.text import plain

_T = TypeVar("_T")
_REASON_CHARACTERS: Final = 300


def fenced(read: Callable[[Path], _T], path: Path, otherwise: Callable[[str], _T]) -> _T:
    """Return what a file holds; ``otherwise(reason)`` where it cannot be read.

    No list of exceptions is complete: parsers of JSON, HDF5 and NumPy raise what their authors did
    not think of, too, for what somebody thought of.
    """
    try:
        return read(path)
    except Exception as error:
        said = getattr(error, "strerror", None) or str(error) or type(error).__name__
        return otherwise(plain(said)[:_REASON_CHARACTERS])
