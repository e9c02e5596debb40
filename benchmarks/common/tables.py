"""Tables of what was measured: plain data, as a record keeps them and as Markdown."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

Cell = str | float | np.floating[Any] | None
"""A text, a number that its column formats, or nothing known."""


class Column(NamedTuple):
    """A column, and how its numbers are formatted: ``.1f``, ``.0%``."""

    name: str
    form: str = ""


def heads(text: str) -> tuple[Column, ...]:
    """Return columns that are stated as in "scene | error, mm:.1f | found"."""
    parts = (re.fullmatch(r"(.*?)(?::([+,]?\.\d[a-z%]))?", each) for each in text.split(" | "))
    return tuple(Column(part.group(1), part.group(2) or "") for part in parts if part)


@dataclass(frozen=True)
class Table:
    """What was measured, or a part of it."""

    title: str
    """What it is about: a heading of the page. Without one the part goes on with the one before."""
    columns: Sequence[Sequence[str]] = ()
    """Texts, or a `Column` of numbers. The first one says what a row is. There may be none: a part
    may be text alone."""
    rows: list[Any] = field(default_factory=list)
    """Sequences of `Cell`, one a column."""
    notes: list[str] = field(default_factory=list)
    """Paragraphs below: how it was measured, and what bars are met. "- " makes an item of a
    list."""
    text: list[str] = field(default_factory=list)
    """Paragraphs between title and table."""

    def shown(self) -> list[list[str]]:
        """Return heads and rows as texts."""
        columns = [each if isinstance(each, Column) else Column(str(each)) for each in self.columns]
        rows = [
            [_shown(cell, column.form) for cell, column in zip(row, columns, strict=True)]
            for row in self.rows
        ]
        return [[column.name for column in columns], *rows]

    def to_document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        columns = [each if isinstance(each, str) else list(each) for each in self.columns]
        rows = [[_rounded(cell) for cell in row] for row in self.rows]
        parts = {"columns": columns, "rows": rows, "text": self.text, "notes": self.notes}
        return {"title": self.title} | {name: part for name, part in parts.items() if part}

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "Table":
        """Return a table that `to_document` made."""
        heads = document.get("columns", ())
        columns = [each if isinstance(each, str) else Column(*each) for each in heads]
        return cls(**{**document, "columns": columns})

    def markdown(self, level: int = 2) -> str:
        """Return it for a page, its title a heading of this level."""
        parts = [f"{'#' * level} {self.title}"] if self.title else []
        parts += _paragraphs(self.text)
        if self.columns:
            head, *rows = self.shown()
            others = list(zip(*rows, strict=True))[1:]
            rules = "".join("---:|" if _numeric(cells) else "---|" for cells in others)
            lines = [_line(head), f"|---|{rules}", *map(_line, rows)]
            parts.append("\n".join(lines))
        return "\n\n".join([*parts, *_paragraphs(self.notes)])


def _shown(cell: Cell, form: str) -> str:
    value = _plain(cell)
    if value is None:
        return "–"
    return value if isinstance(value, str) else format(value, form)


def _plain(cell: Cell) -> str | float | None:
    """Return a cell as JSON knows it, with nothing in the place of what is no number."""
    value = cell.item() if isinstance(cell, np.generic) else cell
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rounded(cell: Cell) -> str | float | None:
    """Return a cell with no more digits than are looked at."""
    value = _plain(cell)
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _numeric(cells: Iterable[str]) -> bool:
    """Whether these line up on the right: they begin as numbers do, or are empty."""
    return all(not cell or cell[0] in "+-–~" or cell[0].isdigit() for cell in cells)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _paragraphs(texts: Sequence[str]) -> list[str]:
    """Return texts as paragraphs, items of a list that follow each other as one."""
    found: list[str] = []
    for text in filter(None, texts):
        if text.startswith("- ") and found and found[-1].startswith("- "):
            found[-1] += f"\n{text}"
        else:
            found.append(text)
    return found


def verdict(value: float, bar: float, text: str) -> str:
    """Return a note on whether a value reaches its bar."""
    met = "met" if value >= bar else f"missed by {100 * (1 - value / bar):.0f} %"
    return f"- Bar: {text}: {value:.3g} for {bar:.3g}, {met}."


def met(held: bool) -> str:
    """Return whether a bar is met, in a word."""
    return "met" if held else "missed"


def percentiles(values: Iterable[float], shares: Sequence[int], form: str = ".1f") -> str:
    """Return the values below which so many per cent are, as in "1.2 / 3.4"; "none" of none."""
    ordered = sorted(values)
    if not ordered:
        return "none"
    picked = (ordered[min(len(ordered) - 1, len(ordered) * share // 100)] for share in shares)
    return " / ".join(format(each, form) for each in picked)
