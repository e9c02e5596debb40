"""The kinds of notices, and what each carries beside its kind."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final


@dataclass(frozen=True, slots=True)
class NoticeKind:
    """One kind of notice."""

    name: str
    summary: str
    keys: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    """The names of JSON types by key; several where it may be either."""
    optional: Sequence[str] = ()
    """Those of them that may be left out."""


_TABLE: Final = tomllib.loads(Path(__file__).with_name("notices.toml").read_text("utf-8"))
NOTICES: Final = {name: NoticeKind(name, **stated) for name, stated in _TABLE.items()}
"""Every kind by its name; a client ignores unknown ones."""
