"""Read a TOML table key by key, with errors that name file, key, value and what is allowed."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError

_Made = TypeVar("_Made")
MOST_M: Final = 1e6
"""Of a coordinate or a size: squares and products of what is allowed stay finite."""
LEAST_M: Final = 1e-6
"""Of a size."""
_NOTHING: Final = 1e-12
"""What is nearer to 0 counts as 0: a picometre; what is divided by it would overflow."""


class Table:
    """A table of a scene file; ``done`` refuses the keys that were not read."""

    def __init__(self, file: str | Path, prefix: str, content: object) -> None:
        self.file = file
        self._prefix = prefix
        self._left: dict[str, Any] = {}
        if not isinstance(content, Mapping):
            raise self.error("", content, "a table")
        self._left = dict(content)
        self._known: list[str] = []

    def error(self, key: str, value: object, allowed: str) -> SceneError:
        """Name a key of this table in an error."""
        full = ".".join(part for part in (self._prefix, key) if part)
        return SceneError(self.file, full or "the file", value, allowed)

    def __contains__(self, key: str) -> bool:
        return key in self._left

    def _take(self, key: str, default: Any) -> Any:
        self._known.append(key)
        if key in self._left:
            return self._left.pop(key)
        if default is None:
            raise self.error(key, None, "present")
        return default

    def text(self, key: str, default: str | None = None) -> str:
        """Read a string."""
        value = self._take(key, default)
        if not isinstance(value, str):
            raise self.error(key, value, "a text")
        return value

    def beside(self, key: str, folder: Path | None) -> Path:
        """Read the name of a file beside the scene's own, in its folder."""
        name = self.text(key)
        if folder is None:
            raise self.error(key, name, "absent: a scene that is sent cannot name files")
        return folder / name

    def choice(self, key: str, allowed: tuple[str, ...], default: str | None = None) -> Any:
        """Read one of a few words; the caller gives the result its type."""
        value = self._take(key, default)
        if value not in allowed:
            raise self.error(key, value, f"one of {', '.join(allowed)}")
        return value

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        least: float = -math.inf,
        most: float = math.inf,
        above: float = -math.inf,
    ) -> float:
        """Read a finite number within limits."""
        value = self._take(key, default)
        if not (_is_finite(value) and least <= value <= most and value > above):
            raise self.error(key, value, "a number" + _limits(least, most, above))
        return float(value)

    def integer(self, key: str, default: int | None = None, *, least: int, most: int) -> int:
        """Read an integer within limits."""
        value = self._take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise self.error(key, value, f"an integer from {least} to {most}")
        return value

    def switch(self, key: str, default: bool) -> bool:
        """Read true or false."""
        value = self._take(key, default)
        if not isinstance(value, bool):
            raise self.error(key, value, "true or false")
        return value

    def vector(self, key: str, default: tuple[float, ...] | None = None) -> NDArray[np.float64]:
        """Read a place or a direction: three numbers in m, of at most `MOST_M`."""
        return self._place(key, self._take(key, default), f"a list of 3 numbers{_WITHIN}")

    def vectors(self, key: str, default: Any = None, *, least: int) -> NDArray[np.float64]:
        """Read a list of at least so many places."""
        value = self._take(key, default)
        allowed = f"a list of at least {least} lists of 3 numbers{_WITHIN}"
        if not isinstance(value, list) or len(value) < least:
            raise self.error(key, value, allowed)
        return np.array([self._place(key, item, allowed) for item in value])

    def length(self, key: str) -> float:
        """Read a size in m."""
        return self.number(key, least=LEAST_M, most=MOST_M)

    def lengths(self, key: str, count: int) -> list[float]:
        """Read so many sizes in m."""
        value = self._take(key, None)
        if not _are_numbers(value, count) or not all(LEAST_M <= each <= MOST_M for each in value):
            limits = _limits(LEAST_M, MOST_M, -math.inf)
            raise self.error(key, value, f"a list of {count} numbers{limits}")
        return [float(item) for item in value]

    def words(self, key: str) -> list[str]:
        """Read a word or a list of words."""
        value = self._take(key, None)
        words = value if isinstance(value, list) else [value]
        if not words or not all(isinstance(word, str) for word in words):
            raise self.error(key, value, "a text or a list of texts")
        return words

    def _place(self, key: str, value: Any, allowed: str) -> NDArray[np.float64]:
        if not _are_numbers(value, 3) or not all(abs(each) <= MOST_M for each in value):
            raise self.error(key, value, allowed)
        place = np.array(value, dtype=np.float64)
        place[np.abs(place) < _NOTHING] = 0.0
        return place

    def table(self, key: str) -> "Table":
        """Enter a table inside this one; empty when absent."""
        return Table(self.file, self._path(key), self._take(key, {}))

    def tables(self, key: str) -> list["Table"]:
        """Enter a list of tables (``[[key]]``); empty when absent."""
        value = self._take(key, [])
        if not isinstance(value, list):
            raise self.error(key, value, f"a list of tables, written [[{key}]]")
        return [
            Table(self.file, f"{self._path(key)}[{index}]", item)
            for index, item in enumerate(value)
        ]

    def done(self, made: _Made) -> _Made:
        """Return what was made of it; refuse keys that were not read: most likely misspelt."""
        for key, value in self._left.items():
            raise self.error(key, value, f"absent; known here are {', '.join(self._known)}")
        return made

    def _path(self, key: str) -> str:
        return f"{self._prefix}.{key}" if self._prefix else key


def _are_numbers(value: object, count: int) -> bool:
    return isinstance(value, list | tuple) and len(value) == count and all(map(_is_finite, value))


def _is_finite(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer that no float can hold
        return False


_WITHIN: Final = f" from {-MOST_M:g} to {MOST_M:g}"


def _limits(least: float, most: float, above: float) -> str:
    words = []
    if above > -math.inf:
        words.append(f"above {above:g}")
    if least > -math.inf:
        words.append(f"of at least {least:g}")
    if most < math.inf:
        words.append(f"of at most {most:g}")
    return " " + " and ".join(words) if words else ""
