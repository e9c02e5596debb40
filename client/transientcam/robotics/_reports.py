"""What viewers receive beside frames: lost connections, dropped frames, a camera that is gone."""

import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path
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
    if (row := _REPORTS.get(notice.kind)) is None:
        return None
    said = notice.details
    if notice.kind == "product-failed":
        said = {"why": said.get("detail") or said.get("title") or said.get("type")}
    return Report(row["level"], row["about"], row["text"].format_map(said))


_REPORTS: Final = tomllib.loads(Path(__file__).with_name("reports.toml").read_text("utf-8"))
