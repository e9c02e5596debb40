"""The types that all figures share: pictures, statements of the paper, and tables."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from transientcam_experiments.paper.bench import Bench

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

_TEXTS: Final = tomllib.loads(Path(__file__).with_name("figures.toml").read_text("utf-8"))
"""Of each figure title and caption, and the paper's sentences with their limits."""
_WORDED: Final = ("says", "measure", "otherwise")


@dataclass(frozen=True, slots=True)
class Statement:
    """A sentence of the paper, and what was measured here."""

    source: str
    """Section or figure of the paper."""
    says: str
    """The sentence."""
    measure: str
    """The quantity measured to check it."""
    value: float
    """The measure's value."""
    shown: str
    """The same as text."""
    criterion: str
    """What the value has to be for the statement to hold."""
    passes: bool
    """Whether it is."""
    reason: str = ""
    """Why ours differs; empty where it does not."""


def check(
    source: str,
    says: str,
    measure: str,
    value: float,
    *,
    at_most: float | None = None,
    at_least: float | None = None,
    form: str = "{:.2f}",
    otherwise: str = "",
) -> Statement:
    """Check a value against limits, of which one that is no number keeps none.

    The first arguments are those of `Statement`. ``form`` is how value and limits are shown, and
    ``otherwise`` the reason where the value is outside.
    """
    value = float(value)
    limits = []
    passes = value == value
    if at_least is not None:
        limits.append(f"at least {form.format(at_least)}")
        passes = passes and value >= at_least
    if at_most is not None:
        limits.append(f"at most {form.format(at_most)}")
        passes = passes and value <= at_most
    return Statement(
        source, says, measure, value, form.format(value), " and ".join(limits), bool(passes),
        "" if passes else otherwise,
    )  # fmt: skip


def state(key: str, value: float, **given: Any) -> Statement:
    """Check a value against a sentence that ``figures.toml`` has.

    ``key`` is the figure's number and the sentence's name, as "08.separated". What ``given`` has of
    `check`'s arguments stands in place of that in the file; the rest fills in its texts.
    """
    figure, name = key.split(".")
    stated = _TEXTS[f"figure{figure}"][name]
    worded = {field: stated[field].format(**given) for field in _WORDED if field in stated}
    limits = {
        field: given[field] for field in ("at_least", "at_most", "otherwise") if field in given
    }
    return check(value=value, **(stated | worded | limits))


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers beside a figure; cells are text, numbers, or None where there is no value."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    @classmethod
    def of(cls, title: str, rows: Sequence[Mapping[str, Any]]) -> "Table":
        """Return a table of rows that name their cells by the same columns."""
        return cls(title, tuple(rows[0]), [tuple(row.values()) for row in rows])


@dataclass(frozen=True, slots=True, eq=False)
class FigureResult:
    """A figure as made here: its picture, and the numbers beside it."""

    picture: "Picture"
    statements: Sequence[Statement]
    tables: Sequence[Table]
    remarks: Sequence[str] = field(default=())


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """One figure of the paper."""

    number: int
    title: str
    """``number``, ``title``: as in the paper."""
    caption: str
    """What our picture shows, and how it was captured."""
    make: Callable[[Bench], FigureResult]
    """Captures, computes and draws."""


def figure(number: int, make: Callable[[Bench], FigureResult]) -> PaperFigure:
    """Return a figure with the title and caption that ``figures.toml`` has for it."""
    texts = _TEXTS[f"figure{number:02d}"]
    return PaperFigure(number, texts["title"], texts["caption"], make)
