"""The grids of settings that are measured."""

import itertools
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from transientcam_driver import Sequence, SubPhases
from transientcam_driver.texts import read_text
from transientcam_server.errors import InputError


@dataclass(frozen=True, slots=True)
class Grid:
    """The sequences that are captured, and the sizes that computing is measured at."""

    sequences: tuple[Sequence, ...]
    """Each a point of the plot of capture time."""
    harmonics: tuple[int, ...] = (3, 4, 8)
    """m at which computing and transport are measured."""
    bins: tuple[int, ...] = (64, 256)
    """Times of flight at which densities are evaluated there."""


def _around(base: Sequence, **values: tuple[Any, ...]) -> Iterator[Sequence]:
    """Yield sequences that differ from one in a field at a time."""
    for name, each in values.items():
        for value in each:
            yield replace(base, **{name: value})


def _frequency_hz(harmonics: int) -> float:
    """Return the paper's choice: 23 MHz, and half of it for m = 8."""
    return 11.5e6 if harmonics > 6 else 23e6


def _paper() -> tuple[Sequence, ...]:
    """M against takes, as in Fig. 8; then one field at a time around its single take of m = 4."""
    crossed = [
        Sequence(harmonics=m, base_frequency_hz=_frequency_hz(m), takes=takes)
        for m, takes in itertools.product((1, 2, 3, 4, 6, 8), (1, 4, 20))
    ]
    video = [
        Sequence(harmonics=m, zeroth="estimated", exposure_s=exposure_s)
        for m, exposure_s in itertools.product((2, 3, 4), (0.0005, 0.00192))
    ]
    around = _around(
        Sequence(harmonics=4),
        zeroth=("on-off", "estimated"),
        exposure_s=(0.00025, 0.0005, 0.001, 0.0025),
        takes=(2, 8, 40),
        sub_phases=(
            SubPhases("none"),
            SubPhases("arccos", 3),
            SubPhases("harmonic-cancellation", 3),
        ),
    )
    return tuple(dict.fromkeys([*crossed, *video, *around]))


GRIDS: Final[dict[str, Grid]] = {
    "paper": Grid(_paper()),
    "quick": Grid(
        (
            Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005),
            Sequence(harmonics=3),
            Sequence(harmonics=4),
            Sequence(harmonics=4, takes=4),
            Sequence(harmonics=8, base_frequency_hz=11.5e6),
        ),
        harmonics=(3,),
        bins=(64,),
    ),
}
"""Grids by name."""


def load_grid(name: str) -> Grid:
    """Return a grid by its name or from a .toml.

    The file holds ``[[sequence]]`` tables, each a sequence document in which a list in the place
    of a value stands for all of its values, and optionally ``harmonics`` and ``bins``.
    Raises InputError naming the part of the file that cannot be used; SequenceError naming the
    field of a sequence.
    """
    if name in GRIDS:
        return GRIDS[name]
    path = Path(name)
    if not path.is_file():
        raise InputError(name, "grid", "missing", f"one of {', '.join(GRIDS)}, or a .toml")
    try:
        document = tomllib.loads(read_text(path))
    except ValueError as error:
        raise InputError(name, "grid", "no TOML", str(error)) from error
    tables = document.get("sequence")
    if not isinstance(tables, list) or not tables:
        raise InputError(name, "sequence", repr(tables), "at least one [[sequence]]")
    sequences = [
        Sequence.from_document(each) for table in tables for each in _expanded(name, table)
    ]
    numbers = {
        key: _whole_numbers(name, key, document[key])
        for key in ("harmonics", "bins")
        if key in document
    }
    return Grid(tuple(dict.fromkeys(sequences)), **numbers)


def _expanded(name: str, table: object) -> Iterator[dict[str, Any]]:
    if not isinstance(table, Mapping):
        raise InputError(name, "sequence", repr(table), "a table")
    choices = [value if isinstance(value, list) else [value] for value in table.values()]
    for values in itertools.product(*choices):
        yield dict(zip(table, values, strict=True))


def _whole_numbers(name: str, key: str, values: object) -> tuple[int, ...]:
    if not isinstance(values, list) or not all(
        type(value) is int and value >= 1 for value in values
    ):
        raise InputError(name, key, repr(values), "a list of integers of at least 1")
    return tuple(values)
