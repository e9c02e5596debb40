"""A camera's frames, live, for viewers that speak Foxglove's WebSocket protocol.

What no viewer has subscribed to is neither asked of the camera nor encoded. Viewers see the
parameters; they set them only where the bridge was given control, and start the light only where
it was given that, too.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from numpy.typing import NDArray

from transientcam.admission import Admission
from transientcam.camera import Camera
from transientcam.frame import Frame
from transientcam.robotics._controls import Controls
from transientcam.robotics._foxglove_messages import encode, schema_of
from transientcam.robotics._messages import (
    Calibration,
    Message,
    Transform,
    messages_of,
    products_of,
    topics_of,
)
from transientcam.robotics._reports import Report
from transientcam.robotics._source import Source, captured_s, require_viewable
from transientcam.robotics._viewer_server import ViewerServer
from transientcam.robotics._watching import SERVICES, Watching
from transientcam.wire import Notice

SHOWN: Final = ("range", "direct", "indirect", "brightness", "pointcloud")
"""Products that viewers can choose from, if nothing else is said."""
_FIXED: Final = frozenset((Transform.topic, Calibration.topic))
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
        Whether viewers may set parameters, and stop the camera.
    control_light
        Whether they may also start it, for good or for one capture: that switches the light on.
    origins
        Pages whose connections are accepted, such as https://app.foxglove.dev; programs need none.
    on_report
        Called with what viewers are shown, too: losses and lost connections.
    now_ns
        Unix time in ns: of what is sent without a frame, and between reports of dropped ones.

    Raises
    ------
    ParameterError
        If a product cannot be shown, or an origin is none.
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
        control_light: bool = False,
        origins: Sequence[str] = (),
        on_report: Callable[[Report], object] = lambda report: None,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        require_viewable(camera, products)
        self._max_rate_hz = max_rate_hz
        self._now_ns = now_ns
        controls = Controls(
            camera,
            holder="transientcam foxglove",
            writable=control or control_light,
            light=control_light,
        )
        # what it shows and changes it does by the right of its token
        lends = control or control_light or camera.has_token
        self._admission = Admission.to(host, lends_right=lends, origins=origins)
        self._source = Source(
            camera,
            on_report=on_report,
            publish=lambda each: self._server.publish_status(each.text, each.level, each.about),
            on_notice=self._noticed,
            now_ns=now_ns,
        )
        self._watching = Watching(controls)
        self._newest = 0
        self._direct: Frame | None = None
        kinds: dict[str, type[Message]] = {
            Transform.topic: Transform,
            Calibration.topic: Calibration,
        }
        for name in products:
            kinds |= topics_of(name)
        self._server = ViewerServer(
            name=f"transientcam {camera.url}",
            host=host,
            port=port,
            admission=self._admission,
            channels={topic: schema_of(kind) for topic, kind in kinds.items()},
            services=SERVICES,
            listener=self._watching,
        )
        self._watching.on_report = self._source.report

    @property
    def url(self) -> str:
        """Where viewers connect to, with the secret where one is required."""
        return f"ws://{self._admission.host}:{self._server.port}{self._admission.path}"

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
        self._server.close()

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
        time_ns = round(captured_s(frame) * 1e9)
        self._send({frame.product: frame.array}, time_ns, topics)

    def _send(
        self, arrays: Mapping[str, NDArray[Any]], time_ns: int, topics: frozenset[str]
    ) -> None:
        of_frame = self._direct if self._direct and self._direct.frame == self._newest else None
        intensity = None if of_frame is None else of_frame.array
        for message in messages_of(arrays, self._source.lens, intensity=intensity, topics=topics):
            self._server.publish(message.topic, time_ns, encode(message, time_ns).data)

    def _noticed(self, notice: Notice) -> None:
        if notice.kind in _PARAMETERS_CHANGE:
            self._server.publish_parameters(self._watching.parameters())
