"""A camera's frames, live, for viewers that speak Foxglove's WebSocket protocol.

What nobody looks at is neither asked of the camera nor encoded. Viewers can only look: the server
offers them no parameter and no service.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import foxglove
from foxglove import StatusLevel
from numpy.typing import NDArray

from transientcam.camera import Camera
from transientcam.errors import (
    ParameterError,
    ProblemError,
    ServerUnreachable,
    StreamClosed,
)
from transientcam.frame import Frame
from transientcam.robotics.foxglove_messages import PROTOBUF, encode, schema_of
from transientcam.robotics.messages import (
    Calibration,
    Message,
    Pinhole,
    Transform,
    messages_of,
    products_of,
    topics_of,
    viewable,
)
from transientcam.robotics.reports import Report, report_of
from transientcam.robotics.watching import Watching
from transientcam.stream import Stream
from transientcam.wire import PRODUCTS, Notice

SHOWN: Final = ("range", "direct", "indirect", "brightness", "pointcloud")
"""Products that viewers can choose from, if nothing else is said."""
RETRY_S: Final = 2.0
DROPPED_EVERY_NS: Final = 5 * 10**9
"""How often the count of dropped frames is shown; it changes with each of them."""
_BACKLOG: Final = 32
"""Messages kept for a viewer that is too slow; the oldest are dropped."""
_FIXED: Final = frozenset((Transform.topic, Calibration.topic))
_LEVELS: Final = {
    "info": StatusLevel.Info,
    "warning": StatusLevel.Warning,
    "error": StatusLevel.Error,
}
_LENS_MAY_CHANGE: Final = ("reconnected", "sequence-changed", "simulation-changed")


class FoxgloveBridge:
    """Serves a camera to viewers.

    ``run`` belongs to one thread; ``close`` may be called from any.

    Parameters
    ----------
    camera
        Whose frames.
    products
        What viewers can choose from: products that are images, and points.
    host, port
        Where viewers find it; port 0 chooses a free one.
    max_rate_hz
        No more frames a second than this; None for all.
    on_report
        Called with what viewers are shown, too: losses and lost connections.
    now_ns
        Unix time in ns: of what is sent without a frame, and between reports of dropped ones.

    Raises
    ------
    ParameterError
        If a product cannot be shown.
    ServerUnreachable, ProblemError
        If the camera does not say its lens.
    OSError
        If nothing can be served at the port.
    """

    def __init__(
        self,
        camera: Camera,
        *,
        products: Sequence[str] = SHOWN,
        host: str = "127.0.0.1",
        port: int = 8765,
        max_rate_hz: float | None = 10.0,
        on_report: Callable[[Report], object] = lambda report: None,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        can_be_shown = [name for name in PRODUCTS if viewable(name) and name != "raw"]
        for name in products:
            if name not in can_be_shown:
                raise ParameterError("products", name, f"some of {', '.join(can_be_shown)}")
        self._camera = camera
        self._max_rate_hz = max_rate_hz
        self._on_report = on_report
        self._now_ns = now_ns
        self._last_report: Report | None = None
        self._dropped_ns = 0
        self._watching = Watching()
        self._stream: Stream | None = None
        self._ask_lens()
        self._newest = 0
        self._direct: Frame | None = None
        self._context = foxglove.Context()
        kinds: dict[str, type[Message]] = {
            Transform.topic: Transform,
            Calibration.topic: Calibration,
        }
        for name in products:
            kinds |= topics_of(name)
        self._channels = {
            topic: foxglove.Channel(
                topic, schema=schema_of(kind), message_encoding=PROTOBUF, context=self._context
            )
            for topic, kind in kinds.items()
        }
        try:
            self._server = foxglove.start_server(
                name=f"transientcam {camera.url}",
                host=host,
                port=port,
                server_listener=self._watching,
                context=self._context,
                message_backlog_size=_BACKLOG,
            )
        except RuntimeError as error:
            raise OSError(None, f"cannot serve viewers ({error})", f"{host}:{port}") from error

    @property
    def port(self) -> int:
        """Where viewers connect to."""
        return self._server.port

    def run(self) -> None:
        """Send frames to whoever looks, until it is closed."""
        topics: frozenset[str] = frozenset()
        while not self._watching.closed:
            topics = self._watching.other_than(topics)
            # lens and pose come with frames, but can also be looked at alone
            self._send({}, self._now_ns(), topics)
            if not products_of(topics):
                continue
            try:
                topics = self._follow(topics)
            except (ServerUnreachable, StreamClosed, ProblemError) as error:
                topics = frozenset()
                if not self._watching.closed:
                    self._report(Report("error", "connection", str(error)))
                    self._watching.pause(RETRY_S)

    def close(self) -> None:
        """Disconnect viewers and camera; ``run`` returns."""
        self._watching.close()
        if self._stream is not None:
            self._stream.close()
        self._server.stop()
        for channel in self._channels.values():
            channel.close()

    def __enter__(self) -> "FoxgloveBridge":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _follow(self, topics: frozenset[str]) -> frozenset[str]:
        """Send frames while they are looked at; return the topics that were last."""
        wanted = products_of(topics)
        self._ask_lens()
        self._stream = self._camera.stream(
            *wanted, on_notice=self._noticed, reconnect=True, max_rate_hz=self._max_rate_hz
        )
        with self._stream as stream:
            self._report(Report("info", "connection", f"streaming {', '.join(wanted)}"))
            while wanted:
                self._send_frame(stream.receive(), topics)
                topics = self._watching.topics
                now = products_of(topics)
                if now and now != wanted:
                    stream.subscribe(*now, max_rate_hz=self._max_rate_hz)
                wanted = now
        self._report(Report("info", "connection", "nobody looks: the stream is closed"))
        return topics

    def _send_frame(self, frame: Frame, topics: frozenset[str]) -> None:
        if "intrinsics" in frame.extra:
            self._lens = Pinhole.of_document(frame.extra["intrinsics"])
        elif self._lens_is_old:
            self._ask_lens()
        if frame.product == "direct":
            self._direct = frame
        if frame.frame == self._newest:
            topics -= _FIXED  # they came with another product of this frame
        self._newest = frame.frame
        time_ns = round(frame.meta["host_time_s"] * 1e9)
        self._send({frame.product: frame.array}, time_ns, topics)

    def _send(
        self, arrays: Mapping[str, NDArray[Any]], time_ns: int, topics: frozenset[str]
    ) -> None:
        of_frame = self._direct if self._direct and self._direct.frame == self._newest else None
        intensity = None if of_frame is None else of_frame.array
        for message in messages_of(arrays, self._lens, intensity=intensity, topics=topics):
            encoded = encode(message, time_ns)
            self._channels[message.topic].log(encoded.data, log_time=time_ns)

    def _ask_lens(self) -> None:
        self._lens = Pinhole.of_document(self._camera.camera["intrinsics"])
        self._lens_is_old = False

    def _noticed(self, notice: Notice) -> None:
        self._lens_is_old |= notice.kind in _LENS_MAY_CHANGE
        report = report_of(notice)
        if report is None:
            return
        if report.about == "dropped":
            now_ns = self._now_ns()
            if now_ns - self._dropped_ns < DROPPED_EVERY_NS:
                return
            self._dropped_ns = now_ns
        self._report(report)

    def _report(self, report: Report) -> None:
        if report != self._last_report:
            self._last_report = report
            self._on_report(report)
        self._server.publish_status(report.text, _LEVELS[report.level], report.about)
