"""The calibrations that a daemon keeps; one class for `Camera` and `AsyncCamera`."""

from collections.abc import Callable
from typing import Any, Final, Generic, TypeVar
from urllib.parse import quote

from transientcam.requests._request import Request, document, file, upload

_BINARY: Final = "application/octet-stream"
_Document = TypeVar("_Document")
_Bytes = TypeVar("_Bytes")
_EXTRA_S: Final = 60.0
"""How much longer than usual it takes to send or evaluate a file that may be large."""


class Calibrations(Generic[_Document, _Bytes]):
    """The calibrations of a daemon; made by ``camera.calibrations``.

    Methods return a document (or bytes); those of an `AsyncCamera` an awaitable of it.

    ::

        job = camera.calibrations.measure(name="after warm-up", frames=40)
        done = camera.wait_for(job["id"])
        camera.calibrations.activate(done["result"]["calibration"])
    """

    def __init__(
        self,
        ask: Callable[[Request[dict[str, Any]]], _Document],
        fetch: Callable[[Request[bytes]], _Bytes],
    ) -> None:
        self._ask = ask
        self._fetch = fetch

    def all(self) -> _Document:
        """Return all of them, in ``calibrations``, the newest first, and the ``active`` one."""
        return self._ask(document("calibrations"))

    def get(self, calibration_id: str) -> _Document:
        """Return the description of one."""
        return self._ask(document(_path(calibration_id)))

    def measure(
        self,
        *,
        name: str = "",
        frames: int = 40,
        activate: bool = False,
        force: bool = False,
        harmonics: bool = True,
    ) -> _Document:
        """Start measuring one with the present sequence; returns the job.

        Put filter and diffuser before the lens first, so that the light shines at the sensor. The
        job's result says in ``verdict`` whether the images look so; what was measured on a scene
        is not used, and ``activated`` false, unless with ``force``. ``harmonics`` sweeps the phase
        as well, with 30 frames or more and a camera that can.
        """
        body = {"name": name, "frames": frames, "activate": activate, "force": force}
        if not harmonics:  # true by itself; a daemon of an earlier version knows no such field
            body["harmonics"] = harmonics
        return self._ask(document("calibrations", method="POST", body=body))

    def active(self) -> _Document:
        """Return which one is active, and which one frames are calibrated with at present."""
        return self._ask(document("calibrations/active"))

    def activate(self, calibration_id: str, *, force: bool = False) -> _Document:
        """Use one, or ``"nominal"`` for none, from the next frame on.

        One that was not measured on a diffuser is refused (``calibration-doubted``) unless with
        ``force``.
        """
        body = {"id": calibration_id, "force": force}
        return self._ask(
            document("calibrations/active", method="PUT", body=body, extra_timeout_s=_EXTRA_S)
        )

    def undo(self) -> _Document:
        """Use the one again that was active before the present one, ``former`` of `active`."""
        return self._ask(
            document("calibrations/active/undo", method="POST", extra_timeout_s=_EXTRA_S)
        )

    def export(self, calibration_id: str) -> _Bytes:
        """Return the file of one, an .npz."""
        return self._fetch(file(_path(calibration_id) + "/file", _BINARY))

    def take_in(self, content: bytes) -> _Document:
        """Import a file that was exported, and return its description."""
        return self._ask(
            upload("calibrations/import", content, media_type=_BINARY, extra_timeout_s=_EXTRA_S)
        )

    def delete(self, calibration_id: str) -> _Document:
        """Delete one for good."""
        return self._ask(document(_path(calibration_id), method="DELETE"))


def _path(calibration_id: str) -> str:
    return f"calibrations/{quote(calibration_id, safe='')}"
