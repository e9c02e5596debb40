"""How every verb writes: the one place where text from elsewhere becomes fit for a terminal.

Of rich, much of which reads markup in texts, nothing else imports anything (``banned-api`` in
pyproject.toml), so that a name with brackets is shown as it is.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.segment import Segment
from rich.status import Status
from rich.table import Table
from rich.text import Text

from transientcam.text import plain

if TYPE_CHECKING:
    from rich.progress import Progress

__all__ = ["Live", "Terminal", "Text", "echo", "escape", "progress_bar", "progress_bars"]

_LEAST_COLUMNS: Final = 40
_COLUMNS_OF_NO_TERMINAL: Final = 10_000
"""Another program reads it: nothing is broken or cut off."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print text as it is, but for what a terminal would obey."""
    typer.echo(plain(text, lines=True), err=err)


class Terminal(Console):
    """A console whose text is plain, and in which brackets are brackets; colours are by style."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)
        if not self.is_terminal:
            self.width = _COLUMNS_OF_NO_TERMINAL
        elif self.width < _LEAST_COLUMNS:  # COLUMNS may be 0
            self.width = _LEAST_COLUMNS

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; lines of texts are not broken, for names and addresses are copied from them."""
        texts = all(isinstance(each, str | Text) for each in objects)
        super().print(*objects, **{"soft_wrap": texts, **options})

    def table(self, *heads: str, rows: Iterable[Iterable[str]]) -> None:
        """Print a table; no cell is cut off."""
        table = Table(box=None)
        for head in heads:
            table.add_column(head, overflow="fold")
        for row in rows:
            table.add_row(*row)
        self.print(table)

    def status(self, status: Any, **options: Any) -> Status:
        """Return what shows a text as long as something takes."""
        return _PlainStatus(Text(status), console=self, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Return what is printed of something."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text, lines=True), style, control)


class _PlainStatus(Status):
    def update(self, status: Any = None, **options: Any) -> None:
        """Show another text."""
        super().update(Text(status), **options)


def progress_bars(
    *, console: Terminal | None = None, counted: bool = False, transient: bool = False
) -> "Progress":
    """Return bars for several tasks; ``counted`` shows "3/12" in place of a percentage."""
    from rich import progress

    return progress.Progress(
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.MofNCompleteColumn() if counted else progress.TaskProgressColumn(),
        progress.TimeElapsedColumn(),
        progress.TimeRemainingColumn(),
        console=console or Terminal(stderr=True),
        transient=transient,
    )


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show one bar; the caller reports progress to its value as (done, total)."""
    with progress_bars() as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
