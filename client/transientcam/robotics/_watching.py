"""What viewers look at and ask for, known to the bridge that serves them."""

import json
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from foxglove import Schema

from transientcam.errors import TransientcamError
from transientcam.robotics._controls import Controls
from transientcam.robotics._reports import Report

CAPTURE: Final = "/capture"
"""The service that waits for the next frame and answers with its metadata."""


class Watching:
    """Counts the viewers of each topic, and answers them about parameters.

    The server calls it from threads of its own.

    ``controls``: the camera's parameters.
    ``on_report``: called with what was refused, and why; to be set once the server runs.
    """

    def __init__(self, controls: Controls) -> None:
        self.on_report: Callable[[Report], object] = lambda report: None
        self._controls = controls
        self._changed = threading.Condition()
        self._viewers: Counter[str] = Counter()
        self._closed = False

    def subscribed(self, topic: str) -> None:
        """Count a viewer of a topic."""
        with self._changed:
            self._viewers[topic] += 1
            self._changed.notify_all()

    def unsubscribed(self, topic: str) -> None:
        """Discount a viewer, also one whose connection broke."""
        with self._changed:
            self._viewers[topic] -= 1
            self._changed.notify_all()

    def parameters(self, names: Iterable[str] = ()) -> list[dict[str, Any]]:
        """Return the present values; none where the daemon does not answer."""
        try:
            found = self._controls.read(names)
        except TransientcamError as error:
            self.on_report(Report("error", "parameter", str(error)))
            return []
        return [
            # a float without a fraction would look like an integer
            {"name": name, "value": value}
            | ({"type": "float64"} if isinstance(value, float) else {})
            for name, value in found.items()
        ]

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set what may be set."""
        try:
            self._controls.write(values)
        except TransientcamError as error:
            self.on_report(Report("error", "parameter", str(error)))

    def call(self, service: str) -> dict[str, Any]:
        """Wait for the next frame, and return its metadata: `CAPTURE` is the only service."""
        return self._controls.capture()

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


def _object(name: str) -> Schema:
    data = json.dumps({"title": name, "type": "object"}).encode()
    return Schema(name=name, encoding="jsonschema", data=data)


SERVICES: Final = {
    CAPTURE: (_object("transientcam/CaptureRequest"), _object("transientcam/FrameMeta"))
}
"""Its request is empty, its response a frame's metadata."""
