"""All measurements: what each is called, where it is computed, and which page it is on.

A measurement is a function that returns tables; its keyword arguments are its options, and its
docstring says what it does. ``python -m benchmarks NAME`` runs it. Nothing is imported before that.
"""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final


@dataclass(frozen=True)
class Measurement:
    """A function, and what becomes of its tables."""

    at: str
    """Module below this package, and function unless that is ``tables``: ``speed.density``."""
    page: str | None = None
    """In docs/, without its suffix. Without one the function writes what it makes by itself."""
    of: tuple[str, ...] = ()
    """Paths whose code is measured: where they have changed since, figures are called old."""
    level: int = 2
    """Of the headings on the page."""
    named: str = ""
    """What it is called by where that is not the name of its module."""
    by_hand: bool = False
    """Whether it is left out when pages are made: it needs something that is not at hand."""
    timed: bool = True
    """Whether figures depend on the machine."""

    @property
    def module(self) -> str:
        """Where the function is, below this package."""
        return self.at.partition(":")[0]

    @property
    def function(self) -> str:
        """The name of the function there."""
        return self.at.partition(":")[2] or "tables"

    @property
    def name(self) -> str:
        """That it is called by."""
        return self.named or self.module.rpartition(".")[2]


def _listed() -> Iterator[Measurement]:
    document = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    for each in document["catalogue"]["measurements"]:
        of = tuple(document["paths"][name] for name in each.pop("of", ()))
        yield Measurement(**each, of=of)


MEASUREMENTS: Final = {each.name: each for each in _listed()}
"""Those of catalogue.toml by their names, in the order of their pages."""
