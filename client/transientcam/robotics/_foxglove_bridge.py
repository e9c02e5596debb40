"""A camera's frames, live, for viewers that speak Foxglove's WebSocket protocol.

What no viewer has subscribed to is neither asked of the camera nor encoded. Viewers see the
parameters; they set them only where the bridge was given control.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Final

import foxglove
from foxglove import StatusLevel
from foxglove.websocket import Capability
from numpy.typing import NDArray

from transientcam.camera import Camera
from transientcam.errors import ParameterError, TransientcamError
from transientcam.frame import Frame
from transientcam.robotics._controls import Controls
from transientcam.robotics._foxglove_messages import PROTOBUF, encode, schema_of
from transientcam.robotics._messages import (
    Calibration,
    Message,
    Transform,
    messages_of,
    products_of,
    topics_of,
    viewable,
)
from transientcam.robotics._reports import Report
from transientcam.robotics._source import Source
from transientcam.robotics._watching import Watching, capture_service, parameters_of
from transientcam.wire import PRODUCTS, Notice

SHOWN: Final = ("range", "direct", "indirect", "brightness", "pointcloud")
"""Products that viewers can choose from, if nothing else is said."""
_BACKLOG: Final = 32
"""Messages kept for a viewer that is too slow; the oldest are dropped."""
_FIXED: Final = frozenset((Transform.topic, Calibration.topic))
_LEVELS: Final = {
    "info": StatusLevel.Info,
    "warning": StatusLevel.Warning,
    "error": StatusLevel.Error,
}
_PARAMETERS_CHANGE: Final = ("reconnected", "sequence-changed", "reconstruction-changed")


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
    control
        Whether viewers may set parameters, and start a camera that is stopped for one capture.
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
        control: bool = False,
        on_report: Callable[[Report], object] = lambda report: None,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        can_be_shown = [name for name in PRODUCTS if viewable(name) and name != "raw"]
        for name in products:
            if name not in can_be_shown:
                raise ParameterError("products", name, f"some of {', '.join(can_be_shown)}")
        self._max_rate_hz = max_rate_hz
        self._now_ns = now_ns
        self._controls = Controls(camera, holder="transientcam foxglove", writable=control)
        self._source = Source(
            camera,
            on_report=on_report,
            publish=self._publish,
            on_notice=self._noticed,
            now_ns=now_ns,
        )
        self._watching = Watching(self._controls)
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
                capabilities=[Capability.Parameters, Capability.Services],
                supported_encodings=["json"],
                services=[capture_service(self._controls)],
                server_listener=self._watching,
                context=self._context,
                message_backlog_size=_BACKLOG,
            )
        except RuntimeError as error:
            raise OSError(None, f"cannot serve viewers ({error})", f"{host}:{port}") from error
        self._watching.on_report = self._source.report

    @property
    def port(self) -> int:
        """Where viewers connect to."""
        return self._server.port

    def run(self) -> None:
        """Send frames to the viewers that are subscribed, until it is closed."""
        topics: frozenset[str] = frozenset()
        while not self._source.closed:
            topics = self._watching.other_than(topics)
            # lens and pose come with frames, but can also be looked at alone
            self._send({}, self._now_ns(), topics)
            if products_of(topics):
                topics = self._source.attempt(partial(self._follow, topics), frozenset())

    def close(self) -> None:
        """Disconnect viewers and camera; ``run`` returns."""
        self._source.close()
        self._watching.close()
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
        with self._source.stream(*wanted, max_rate_hz=self._max_rate_hz) as stream:
            self._source.report(Report("info", "connection", f"streaming {', '.join(wanted)}"))
            while wanted:
                self._send_frame(stream.receive(), topics)
                topics = self._watching.topics
                now = products_of(topics)
                if now and now != wanted:
                    stream.subscribe(*now, max_rate_hz=self._max_rate_hz)
                wanted = now
        self._source.report(
            Report("info", "connection", "no viewer is subscribed: the stream is closed")
        )
        return topics

    def _send_frame(self, frame: Frame, topics: frozenset[str]) -> None:
        self._source.lens_of(frame)
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
        for message in messages_of(arrays, self._source.lens, intensity=intensity, topics=topics):
            encoded = encode(message, time_ns)
            self._channels[message.topic].log(encoded.data, log_time=time_ns)

    def _noticed(self, notice: Notice) -> None:
        if notice.kind in _PARAMETERS_CHANGE:
            with suppress(TransientcamError):  # the stream reports what is wrong with the camera
                parameters = parameters_of(self._controls)
                self._while_it_serves(partial(self._server.publish_parameter_values, parameters))

    def _publish(self, report: Report) -> None:
        status = report.text, _LEVELS[report.level], report.about
        self._while_it_serves(partial(self._server.publish_status, *status))

    def _while_it_serves(self, publish: Callable[[], None]) -> None:
        """Publish something, unless `close` stops the server, which cannot be called meanwhile."""
        try:
            publish()
        except RuntimeError:  # "Already mutably borrowed"
            if not self._source.closed:
                raise
