"""Recordings of a daemon that is killed with SIGKILL, and their recovery by the next one.

A frame is acknowledged once the service has counted it in the document of the recording.
"""

import random
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.common.daemon import Process, daemon
from benchmarks.common.tables import Table, met
from transientcam_server.recording import Recording

QUICK = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}
MOST_FRAMES = 40
WITHIN_S = 60.0


@dataclass(frozen=True)
class Kill:
    """One of them."""

    acknowledged: int
    recovered: int
    """``acknowledged``, ``recovered``: frames before, and in the file that the next daemon made
    whole by itself."""
    whole: bool
    """Whether each of these is there bit for bit, and they follow one another."""
    open_s: float
    """From the start of the next daemon until the file was whole."""


def measure_kills(directory: Path, *, kills: int) -> list[Kill]:
    """Kill a daemon so often, and look at what was recovered."""
    environment = {"XDG_DATA_HOME": str(directory), "TRANSIENTCAM_KERNELS": "off"}
    draw = random.Random(6)
    found: list[Kill] = []
    left: tuple[str, int] | None = None
    for kill in range(kills + 1):
        with (
            daemon("--camera", "sim:wall", environment=environment) as process,
            httpx.Client(base_url=f"{process.url}/api/v1/", timeout=WITHIN_S) as client,
        ):
            if left is not None:
                found.append(_recovered(client, process, directory, *left))
            if kill < kills:
                left = _record(client, frames=draw.randint(1, MOST_FRAMES))
                process.kill()
    return found


def _record(client: httpx.Client, *, frames: int) -> tuple[str, int]:
    """Record at least so many, and return what the service says there are."""
    client.put("sequence", json=QUICK).raise_for_status()
    identity = client.post("recordings", json={}).raise_for_status().json()["id"]
    document = _until(client, identity, lambda each: each["frames"] >= frames)
    return identity, document["frames"]


def _recovered(
    client: httpx.Client, process: Process, directory: Path, identity: str, acknowledged: int
) -> Kill:
    document = _until(client, identity, lambda each: each["state"] == "complete")
    open_s = process.age_s()
    (path,) = directory.rglob(f"{identity}.h5")
    with Recording(path) as recording:
        times_s = [raw.device_time_s for raw in recording]  # raises for a byte that is another
    steps_s = np.diff(times_s)
    whole = len(times_s) == document["frames"] and bool(np.all(steps_s > 0.0))
    client.delete(f"recordings/{identity}").raise_for_status()
    return Kill(acknowledged, document["frames"], whole, open_s)


def _until(client: httpx.Client, identity: str, wanted: Any) -> dict[str, Any]:
    end_s = time.monotonic() + WITHIN_S
    while time.monotonic() < end_s:
        document: dict[str, Any] = client.get(f"recordings/{identity}").raise_for_status().json()
        if wanted(document):
            return document
    raise TimeoutError(f"{identity} is still {document}")


def table(kills: list[Kill]) -> Table:
    """Return what was lost, and how long recovery took."""
    lost = sum(max(0, each.acknowledged - each.recovered) for each in kills)
    wrong = sum(not each.whole for each in kills)
    open_s = sorted(each.open_s for each in kills)
    return Table(
        "Killed in mid-recording",
        text=[
            f"`transientcam serve` was killed (SIGKILL) {len(kills)} times while it recorded, "
            f"after 1 to {MOST_FRAMES} frames, and started again.",
            "- Frames that the service had counted: "
            f"{sum(each.acknowledged for each in kills)}; "
            f"of these lost: {lost}. Bar: 0, {met(lost == 0)}.",
            f"- Recordings that the next start did not make whole by itself, or with a frame that "
            f"is not as it was written: {wrong}. Bar: 0, {met(wrong == 0)}.",
            f"- From the start until the file could be read: {open_s[len(open_s) // 2]:.2f} s, "
            f"{open_s[-1]:.2f} s at most.",
        ],
    )
