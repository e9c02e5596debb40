"""A camera as the source of a bridge: its stream, lens and troubles, until the bridge is closed."""

import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, TypeVar

from transientcam.camera import Camera
from transientcam.errors import ParameterError, ProblemError, ServerUnreachable, StreamClosed
from transientcam.frame import Frame
from transientcam.robotics._messages import Pinhole, viewable
from transientcam.robotics._reports import Report, report_of
from transientcam.stream import Stream
from transientcam.wire import PRODUCTS, Notice, Product, Subscription

RETRY_S: Final = 2.0
DROPPED_EVERY_NS: Final = 5 * 10**9
"""How often the count of dropped frames is shown; it changes with each of them."""
_LENS_MAY_CHANGE: Final = ("reconnected", "sequence-changed", "simulation-changed")
_T = TypeVar("_T")


def captured_s(frame: Frame) -> float:
    """Return when a frame was captured, in Unix time; of older daemons when it arrived."""
    captured_unix_s = frame.meta.get("captured_unix_s")
    return float(frame.meta["host_time_s"] if captured_unix_s is None else captured_unix_s)


def require_viewable(camera: Camera, products: Iterable[str], *others: str) -> None:
    """Refuse products that cannot be sent live, ours or another package's (ParameterError).

    The camera is asked where there are any that are not ours.
    """
    known = dict(PRODUCTS)
    if not known.keys() >= {*products} - {*others}:
        for each in camera.info["products"]:
            stated = each["unit"], tuple(each["axes"]), each["dtype"], each["summary"]
            known[each["name"]] = Product(each["name"], *stated)
    can_be_sent = [name for name, each in known.items() if viewable(each) and name != "raw"]
    for name in products:
        if name not in (*can_be_sent, *others):
            raise ParameterError("products", name, f"some of {', '.join((*can_be_sent, *others))}")


class Source:
    """What every bridge needs of a camera.

    ``close`` may be called from any thread, everything else belongs to one.

    Parameters
    ----------
    camera
        Whose frames.
    on_report
        Called with each report that differs from the one before.
    publish
        Called with every report, also where it is repeated: for viewers that come later.
    on_notice
        Called with each notice of the stream.
    now_ns
        Time between reports of dropped frames, in ns.

    Raises
    ------
    ServerUnreachable, ProblemError
        If the camera does not state its lens.
    """

    def __init__(
        self,
        camera: Camera,
        *,
        on_report: Callable[[Report], object],
        publish: Callable[[Report], object] = lambda report: None,
        on_notice: Callable[[Notice], object] = lambda notice: None,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self._camera = camera
        self._on_report = on_report
        self._publish = publish
        self._on_notice = on_notice
        self._now_ns = now_ns
        self._closed = threading.Event()
        self._stream: Stream | None = None
        self._last_report: Report | None = None
        self._dropped_ns = 0
        self._ask_lens()

    @property
    def lens(self) -> Pinhole:
        """As it was last heard of."""
        return self._lens

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return self._closed.is_set()

    def stream(self, *products: str | Subscription, max_rate_hz: float | None = None) -> Stream:
        """Return a stream that connects again by itself; what happens to it is reported."""
        self._ask_lens()
        self._stream = self._camera.stream(
            *products, on_notice=self.noticed, reconnect=True, max_rate_hz=max_rate_hz
        )
        if self.closed:  # while it was made
            self._stream.close()
        return self._stream

    def lens_of(self, frame: Frame) -> Pinhole:
        """Return the lens of a frame's pixels; the daemon is asked where it may have changed."""
        if "intrinsics" in frame.extra:
            self._lens = Pinhole.of_document(frame.extra["intrinsics"])
        elif self._lens_is_old:
            self._ask_lens()
        return self._lens

    def attempt(self, follow: Callable[[], _T], otherwise: _T) -> _T:
        """Return what ``follow`` does; where the camera fails it, report, wait, ``otherwise``."""
        try:
            return follow()
        except (ServerUnreachable, StreamClosed, ProblemError) as error:
            if not self.closed:
                self.report(Report("error", "connection", str(error)))
                self._closed.wait(RETRY_S)
            return otherwise

    def report(self, report: Report) -> None:
        """Hand a report on."""
        if report != self._last_report:
            self._last_report = report
            self._on_report(report)
        self._publish(report)

    def noticed(self, notice: Notice) -> None:
        """Report a notice of the stream, as far as it is about what viewers see."""
        self._lens_is_old |= notice.kind in _LENS_MAY_CHANGE
        self._on_notice(notice)
        report = report_of(notice)
        if report is None:
            return
        if report.about == "dropped":
            now_ns = self._now_ns()
            if now_ns - self._dropped_ns < DROPPED_EVERY_NS:
                return
            self._dropped_ns = now_ns
        self.report(report)

    def close(self) -> None:
        """Close the stream and end every wait."""
        self._closed.set()
        if self._stream is not None:
            self._stream.close()

    def _ask_lens(self) -> None:
        self._lens = Pinhole.of_document(self._camera.camera["intrinsics"])
        self._lens_is_old = False
