"""What viewers look at and ask for, known to the bridge that serves them."""

import json
import threading
from collections import Counter
from collections.abc import Callable
from typing import Final

from foxglove import MessageSchema, Schema
from foxglove.websocket import (
    ChannelView,
    Client,
    Parameter,
    ParameterType,
    ServerListener,
    Service,
    ServiceRequest,
    ServiceSchema,
)

from transientcam.errors import TransientcamError
from transientcam.robotics._controls import Controls
from transientcam.robotics._reports import Report

CAPTURE: Final = "/capture"
"""The service that waits for the next frame and answers with its metadata."""
_JSON: Final = "json"


class Watching(ServerListener):
    """Counts the viewers of each topic, and answers them about parameters.

    The server calls it from threads of its own.

    Parameters
    ----------
    controls
        The camera's parameters.

    Attributes
    ----------
    on_report
        Called with what was refused, and why; to be set once the server runs.
    """

    def __init__(self, controls: Controls) -> None:
        self.on_report: Callable[[Report], object] = lambda report: None
        self._controls = controls
        self._changed = threading.Condition()
        self._viewers: Counter[str] = Counter()
        self._closed = False

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Count a viewer of a topic."""
        with self._changed:
            self._viewers[channel.topic] += 1
            self._changed.notify_all()

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Discount a viewer, also one whose connection broke."""
        with self._changed:
            self._viewers[channel.topic] -= 1
            self._changed.notify_all()

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Answer with the present values; with none where the daemon does not answer."""
        try:
            return parameters_of(self._controls, *param_names)
        except TransientcamError as error:
            self.on_report(Report("error", "parameter", str(error)))
            return []

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Set what may be set, and answer with the values as they are then."""
        try:
            self._controls.write({each.name: each.get_value() for each in parameters})
        except TransientcamError as error:
            self.on_report(Report("error", "parameter", str(error)))
        return self.on_get_parameters(client, [], request_id)

    @property
    def topics(self) -> frozenset[str]:
        """Those that have viewers; none once it is closed."""
        with self._changed:
            return self._topics()

    def other_than(self, topics: frozenset[str]) -> frozenset[str]:
        """Wait until others than these are looked at, or it is closed, and return them."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._topics() != topics)
            return self._topics()

    def close(self) -> None:
        """End every wait."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _topics(self) -> frozenset[str]:
        return frozenset() if self._closed else frozenset(+self._viewers)


def parameters_of(controls: Controls, *names: str) -> list[Parameter]:
    """Return parameters as Foxglove has them; all, if none is named.

    Raises
    ------
    ServerUnreachable, ProblemError
        If the daemon does not answer.
    """
    return [
        # a float without a fraction would look like an integer
        Parameter(name, value=value, type=ParameterType.Float64)
        if isinstance(value, float)
        else Parameter(name, value=value)
        for name, value in controls.read(names).items()
    ]


def capture_service(controls: Controls) -> Service:
    """Return the service `CAPTURE`: its request is empty, its response a frame's metadata."""

    def capture(request: ServiceRequest) -> bytes:
        return json.dumps(controls.capture()).encode()

    return Service(
        CAPTURE,
        schema=ServiceSchema(
            "transientcam/Capture",
            request=_object("transientcam/CaptureRequest"),
            response=_object("transientcam/FrameMeta"),
        ),
        handler=capture,
    )


def _object(name: str) -> MessageSchema:
    data = json.dumps({"title": name, "type": "object"}).encode()
    return MessageSchema(encoding=_JSON, schema=Schema(name=name, encoding="jsonschema", data=data))
