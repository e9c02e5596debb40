"""What viewers receive beside frames: lost connections, dropped frames, a camera that is gone."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

from transientcam.wire import Notice

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Report:
    """Something that happened; one with the same ``about`` takes the place of the one before."""

    level: Level
    about: Literal["connection", "camera", "dropped", "lost-images", "product", "parameter"]
    text: str

    def to_document(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return {"type": "report", **asdict(self)}


def report_of(notice: Notice) -> Report | None:
    """Return what a notice of the stream means to viewers; None for what is not about them."""
    make = _REPORTS.get(notice.kind)
    return None if make is None else make(notice.details)


_REPORTS: Final[Mapping[str, Callable[[Mapping[str, Any]], Report]]] = {
    "connection-lost": lambda said: Report(
        "error", "connection", f"connection to the camera lost: {said['reason']}"
    ),
    "reconnected": lambda said: Report("info", "connection", "connected to the camera again"),
    "camera-lost": lambda said: Report(
        "error", "camera", f"the camera does not answer: {said['reason']}"
    ),
    "camera-back": lambda said: Report("info", "camera", "the camera answers again"),
    "light-arming": lambda said: Report(
        "warning", "camera", f"the light goes on in {said['in_s']:g} s"
    ),
    "light-off": lambda said: Report("warning", "camera", f"the light is off: {said['reason']}"),
    "light-unconfirmed": lambda said: Report("warning", "camera", said["reason"]),
    "dropped": lambda said: Report(
        "warning",
        "dropped",
        f"{said['total']} frames dropped so far: this program or its network is too slow",
    ),
    "lost-images": lambda said: Report(
        "warning", "lost-images", f"{said['count']} images lost before frame {said['frame']}"
    ),
    "product-failed": lambda said: Report(
        "error", "product", str(said.get("detail") or said.get("title") or said.get("type"))
    ),
}
