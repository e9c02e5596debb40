"""The daemon's parameters, and single captures, for viewers that can show and set them."""

import threading
from collections.abc import Iterable, Mapping
from math import ceil
from typing import Any, Final

from transientcam.camera import Camera
from transientcam.errors import ParameterError, ProblemError

_WAIT_S: Final = 10.0
"""The longest that the daemon waits for a frame at once."""
_NO_FRAME: Final = "/problems/no-frame-yet"
_SETTABLE: Final = ("sequence", "reconstruction", "acquisition")
"""The documents of parameters that can be set."""
_NO_LIGHT: Final = "--control-light was not given"


class Controls:
    """What a viewer can read of a camera beside frames, and change where that was allowed.

    A change is made under a lease of its own, which no other client can interrupt; it is refused
    while another one holds the lease. Methods may be called from any thread.

    ``camera``: whose parameters.
    ``holder``: name of the lease.
    ``writable``: whether anything may be changed.
    ``light``: whether the camera may be started, which switches the light on.
    """

    def __init__(self, camera: Camera, *, holder: str, writable: bool, light: bool) -> None:
        self._camera = camera
        self._holder = holder
        self._writable = writable
        self._light = light
        self._one_at_a_time = threading.Lock()

    def read(self, names: Iterable[str] = ()) -> dict[str, Any]:
        """Return the values of these parameters that have one, by name; of all, if none is named.

        Raises ServerUnreachable, ProblemError if the daemon does not answer.
        """
        chosen = frozenset(names)
        return {
            name: each["value"]
            for name, each in self._parameters().items()
            if each["value"] is not None and (not chosen or name in chosen)
        }

    def write(self, values: Mapping[str, Any]) -> None:
        """Set parameters; where one cannot be set, those of the same document are not either.

        Raises ParameterError if nothing may be changed, or a parameter is unknown or read-only;
        ServerUnreachable, ProblemError if the daemon does not answer, refuses a value, or another
        client has the lease.
        """
        known = self._parameters()
        for name, value in values.items():
            self._check(name, value, known)
        changed: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            whole = isinstance(value, float) and value.is_integer()
            changed.setdefault(_document_of(known[name]), {})[known[name]["pointer"]] = (
                # viewers have one type of numbers
                int(value) if known[name]["type"] == "integer" and whole else value
            )
        # what was changed stays, also if this program ends just then
        with self._one_at_a_time, self._camera.lease(self._holder, on_lapse="keep"):
            for document, by_pointer in changed.items():
                self._set(document, by_pointer)

    def capture(self) -> dict[str, Any]:
        """Wait for a frame that is not there yet, and return its metadata.

        A camera that is stopped is started for it, and stopped again.
        Raises ParameterError if it is stopped and may not be started; ServerUnreachable,
        ProblemError if the daemon does not answer, no frame comes, or another client has the lease.
        """
        with self._one_at_a_time:
            newest: int | None = self._camera.frames["last"]
            if self._camera.acquisition["running"]:
                return self._next_frame(newest)
            if not self._light:
                raise ParameterError("acquisition.running", False, f"true: {_NO_LIGHT}")
            with self._camera.lease(self._holder, on_lapse="stop"):
                self._camera.start()
                try:
                    return self._next_frame(newest)
                finally:
                    self._camera.stop()

    def _parameters(self) -> dict[str, dict[str, Any]]:
        return {each["name"]: each for each in self._camera.parameters["parameters"]}

    def _check(self, name: str, value: Any, known: Mapping[str, Mapping[str, Any]]) -> None:
        if not self._writable:
            raise ParameterError(name, value, "left as it is: --control was not given")
        if name not in known:
            raise ParameterError("parameter", name, "one of the camera's")
        each = known[name]
        if each["access"] != "read-write" or _document_of(each) not in _SETTABLE:
            raise ParameterError(name, value, f"left at {each['value']}: it is read-only")
        # all of this document but "stop": what is no bool may yet be taken for one
        if _document_of(each) == "acquisition" and value is not False and not self._light:
            raise ParameterError(name, value, f"false, or left as it is: {_NO_LIGHT}")

    def _set(self, document: str, by_pointer: Mapping[str, Any]) -> None:
        if document == "acquisition":
            (running,) = by_pointer.values()
            if not isinstance(running, bool):
                raise ParameterError("acquisition.running", running, "true or false")
            _ = self._camera.start() if running else self._camera.stop()
            return
        found = self._camera.sequence if document == "sequence" else self._camera.reconstruction
        for pointer, value in by_pointer.items():
            *outer, last = pointer.removeprefix("/").split("/")
            place = found
            for key in outer:
                place = place[key]
            place[last] = value
        if document == "sequence":
            self._camera.sequence = found
        else:
            self._camera.reconstruction = found

    def _next_frame(self, newest: int | None) -> dict[str, Any]:
        for _ in range(ceil(2.0 * self._camera.sequence["capture_s"] / _WAIT_S)):
            try:
                return self._camera.latest(after=newest, wait_s=_WAIT_S)
            except ProblemError as error:
                if error.type != _NO_FRAME:
                    raise
        return self._camera.latest(after=newest, wait_s=_WAIT_S)


def _document_of(parameter: Mapping[str, Any]) -> str:
    return str(parameter["resource"]).rpartition("/")[2]
