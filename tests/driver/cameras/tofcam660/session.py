"""The recorded session of the vendor's client (tests' data, ``tofcam660/session.json``)."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEAD_BYTES, TAIL_BYTES = 8, 4


@dataclass(frozen=True)
class Step:
    """One command of the session, with its markers."""

    name: str
    command: int
    request: bytes
    response: bytes
    image: dict[str, Any] | None

    @property
    def payload(self) -> bytes:
        return self.request[HEAD_BYTES:-TAIL_BYTES]


def steps(data_dir: Path) -> Iterator[Step]:
    """Yield every command; entries that only repeat what the client received are left out."""
    recorded = json.loads((data_dir / "tofcam660" / "session.json").read_text())
    for entry in recorded["exchange"]:
        if "command" in entry:
            request, response = (bytes.fromhex(entry[key]) for key in ("request", "response"))
            yield Step(entry["name"], entry["command"], request, response, entry.get("image"))


def frames(data_dir: Path) -> dict[str, NDArray[Any]]:
    """Return the stored planes by their names."""
    with np.load(data_dir / "tofcam660" / "frames.npz") as stored:
        return dict(stored)
