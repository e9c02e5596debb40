"""``transientcam watch``: statistics of a stream, as it runs."""

import json
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Annotated, Any

import typer

from transientcam.camera import Camera
from transientcam.cli.options import JsonOption, ProductsArgument, TokenOption, UrlArgument
from transientcam.cli.statistics import Sample, Statistics
from transientcam.cli.terminal import Live, Terminal, Text, echo
from transientcam.wire import Notice


def watch(
    url: UrlArgument,
    products: ProductsArgument = None,
    count: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many frames of the first product.")
    ] = None,
    max_rate_hz: Annotated[float | None, typer.Option(help="Maximum frames per second.")] = None,
    reconnect: Annotated[bool, typer.Option(help="Reconnect when the connection is lost.")] = True,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show rate, latency, losses and the median of what a camera streams, until interrupted."""
    names = products or ["range"]
    statistics = Statistics()
    display = Lines() if as_json else Screen(Terminal())

    def on_notice(notice: Notice) -> None:
        statistics.notice(notice)
        display.notice(notice)

    seen = 0
    with Camera(url, token=token) as camera, display.shown():
        stream = camera.stream(
            *names, on_notice=on_notice, reconnect=reconnect, max_rate_hz=max_rate_hz
        )
        try:
            for frame in stream:
                display.sample(statistics.frame(frame, now_s=time.time()))
                seen += frame.product == names[0]
                if seen == count:
                    break
        except KeyboardInterrupt:  # the way to end it, not a failure
            pass


class Lines:
    """One JSON document a line."""

    def __init__(self, write: Callable[[str], Any] = echo) -> None:
        self._write = write

    def shown(self) -> AbstractContextManager[object]:
        """Return the context in which to show."""
        return nullcontext()

    def sample(self, sample: Sample) -> None:
        """Show a frame."""
        self._write(json.dumps(sample.to_document()))

    def notice(self, notice: Notice) -> None:
        """Show a notice."""
        self._write(json.dumps(notice.to_document()))


class Screen:
    """One line a product that changes in place; a line a frame where that cannot be."""

    def __init__(self, console: Terminal) -> None:
        self._console = console
        self._rows: dict[str, Sample] = {}
        self._live = Live(console=console, refresh_per_second=8) if console.is_terminal else None

    def shown(self) -> AbstractContextManager[object]:
        """Return the context in which to show."""
        return self._live or nullcontext()

    def sample(self, sample: Sample) -> None:
        """Show a frame."""
        self._rows[sample.product] = sample
        if self._live is None:
            self._console.print(_line(sample))
        else:
            self._live.update(Text("\n".join(map(_line, self._rows.values()))))

    def notice(self, notice: Notice) -> None:
        """Show a notice."""
        details = "  ".join(
            f"{name} {value}"
            for name, value in notice.details.items()
            if name not in ("sequence", "channels")
        )
        text = Text(f"{notice.kind}  {details}".rstrip(), style="yellow")
        self._console.print(text)


def _line(sample: Sample) -> str:
    rate = "  –  " if sample.rate_hz is None else f"{sample.rate_hz:5.1f}"
    median = "" if sample.median is None else f"  median {sample.median:.4g} {sample.unit}"
    lost = f"  lost images {sample.lost_images}" if sample.lost_images else ""
    return (
        f"{sample.product:<12} #{sample.frame:<6} {rate} Hz  {sample.latency_s * 1e3:6.1f} ms"
        f"  dropped {sample.dropped}{lost}{median}"
    )
