"""The types that all figures share: pictures, statements of the paper, and tables."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from transientcam_experiments.paper.bench import Bench

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture


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
