"""Tables, on the screen and in the documentation."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table as ScreenTable


@dataclass(frozen=True)
class Table:
    """What a topic measured.

    Attributes
    ----------
    title
        What it is about.
    columns
        Their names; the first one says what a row is.
    rows
        One text a column.
    notes
        How it was measured, and what bars are met.
    """

    title: str
    columns: Sequence[str]
    rows: list[Sequence[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def show(self, console: Console) -> None:
        """Print it."""
        table = ScreenTable(title=self.title, title_justify="left", title_style="bold")
        for index, column in enumerate(self.columns):
            table.add_column(column, justify="right" if index else "left")
        for row in self.rows:
            table.add_row(*row)
        console.print(table)
        for note in self.notes:
            console.print(f"  {note}", style="dim", highlight=False)
        console.print()

    def markdown(self) -> str:
        """Return it for a page."""
        lines = [f"## {self.title}", ""]
        lines.append("| " + " | ".join(self.columns) + " |")
        lines.append("|---|" + "---:|" * (len(self.columns) - 1))
        lines += ["| " + " | ".join(row) + " |" for row in self.rows]
        return "\n".join([*lines, "", *self.notes, ""])


def verdict(value: float, bar: float, text: str) -> str:
    """Return a note on whether a bar is met."""
    met = "met" if value >= bar else f"missed by {100 * (1 - value / bar):.0f} %"
    return f"Bar: {text}: {value:.3g} for {bar:.3g}, {met}."


def write_page(path: Path, tables: Sequence[Table], *, machine: str, command: str) -> None:
    """Write tables to a page that says how to make it."""
    head = [
        "# Benchmarks",
        "",
        f"Written by `{command}` on: {machine}.",
        "",
        "Every table was measured in the same run on the same data: medians over many repetitions, "
        "± half the distance between the quartiles.",
        "",
    ]
    path.write_text("\n".join([*head, *(table.markdown() for table in tables)]), encoding="utf-8")


def write_section(path: Path, name: str, tables: Sequence[Table], said: str) -> None:
    """Write tables between the marks that a page has for them, with how they were made."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = path.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    body = "\n".join(table.markdown().replace("## ", "### ", 1) for table in tables)
    path.write_text(f"{before}{begin}\n{body}\n{said}\n{end}{after}", encoding="utf-8")
