"""The calibrations of a daemon, seen from afar; one class for `Camera` and `AsyncCamera`."""

from collections.abc import Callable
from typing import Any, Final, Generic, TypeVar
from urllib.parse import quote

from transientcam.requests import request

_BINARY: Final = "application/octet-stream"
_Document = TypeVar("_Document")
_Bytes = TypeVar("_Bytes")
_PATIENCE_S: Final = 60.0
"""How much longer than usual it takes to send or evaluate what may be large."""


class Calibrations(Generic[_Document, _Bytes]):
    """The calibrations of a daemon; made by ``camera.calibrations``.

    What a method returns is a document (or bytes) from a `Camera`, and to be awaited from an
    `AsyncCamera`.

    ::

        job = camera.calibrations.measure(name="after warm-up", frames=40)
        done = camera.wait_for(job["id"])
        camera.calibrations.activate(done["result"]["calibration"])
    """

    def __init__(
        self,
        ask: Callable[[request.Request[dict[str, Any]]], _Document],
        fetch: Callable[[request.Request[bytes]], _Bytes],
    ) -> None:
        self._ask = ask
        self._fetch = fetch

    def all(self) -> _Document:
        """Return all of them, in ``calibrations``, the newest first, and the ``active`` one."""
        return self._ask(request.document("calibrations"))

    def get(self, calibration_id: str) -> _Document:
        """Describe one."""
        return self._ask(request.document(_path(calibration_id)))

    def measure(self, *, name: str = "", frames: int = 40, activate: bool = False) -> _Document:
        """Start measuring one with the present sequence; returns the job.

        Put filter and diffusor before the lens first, so that the light shines at the sensor.
        """
        wanted = {"name": name, "frames": frames, "activate": activate}
        return self._ask(request.document("calibrations", method="POST", body=wanted))

    def active(self) -> _Document:
        """Return which one is active, and what frames are really calibrated by."""
        return self._ask(request.document("calibrations/active"))

    def activate(self, calibration_id: str) -> _Document:
        """Use one, or ``"nominal"`` for none, from the next frame on."""
        body = {"id": calibration_id}
        return self._ask(
            request.document("calibrations/active", method="PUT", body=body, patience_s=_PATIENCE_S)
        )

    def export(self, calibration_id: str) -> _Bytes:
        """Return the file of one, an .npz."""
        return self._fetch(request.file(_path(calibration_id) + "/file", _BINARY))

    def take_in(self, content: bytes) -> _Document:
        """Let the daemon keep a file that was exported, and describe it."""
        return self._ask(
            request.upload(
                "calibrations/import", content, media_type=_BINARY, patience_s=_PATIENCE_S
            )
        )

    def delete(self, calibration_id: str) -> _Document:
        """Delete one for good."""
        return self._ask(request.document(_path(calibration_id), method="DELETE"))


def _path(calibration_id: str) -> str:
    return f"calibrations/{quote(calibration_id, safe='')}"
