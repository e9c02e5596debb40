"""How every verb writes: the one place where text from elsewhere becomes fit for a terminal."""

from collections.abc import Iterable
from typing import Any

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from transientcam.text import plain


def echo(text: str = "", *, err: bool = False) -> None:
    """Print text as it is, but for what a terminal would obey."""
    typer.echo(plain(text, lines=True), err=err)


class Terminal(Console):
    """A console whose text is plain, and in which brackets are brackets; colours are by style."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False, **options})

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Return what is printed of something."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text, lines=True), style, control)
