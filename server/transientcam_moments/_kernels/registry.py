"""Which lanes this process has: read by every call, written by the thread that compiles."""

from collections.abc import Callable
from typing import Any

# A lane is looked up by (name, m, precision); precision is the character of the real type.
Key = tuple[str, int, str]

PRECISIONS = {"f": "f", "F": "f", "d": "d", "D": "d"}

compiled: dict[Key, Callable[..., Any]] = {}
