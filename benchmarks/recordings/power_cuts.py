"""Recordings whose writer's power is cut: what a disk may have kept, and what recovery finds.

What the writer did to its file, traced by strace, is replayed up to a random moment. Of what was
written since the last fsync each kind of disk keeps another part.
"""

import random
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.common.tables import Table, heads
from tests.server.fuzzing.recordings import in_memory
from tests.server.recording.made import frame
from tests.server.recording.power import DISKS, Event, cut, moments, traced
from transientcam_server.errors import NotARecording
from transientcam_server.recording import Recording, recover

FRAMES = 100
"""Of a recording, which lasts 10 s."""
WHAT = {
    "nothing": "none of it",
    "everything": "all of it, as when the process is killed",
    "in order, torn": "the first writes, and of the next one the first sectors",
    "pages in any order": "of each page of 4 KiB any version it had, whatever the others have",
    "sectors in any order": "the same of each sector of 512 B",
}


@dataclass(frozen=True)
class Survived:
    """What was left after a cut."""

    acknowledged: int
    recovered: int
    """``acknowledged``, ``recovered``: frames before the cut, and after recovery."""
    lost: int
    """Acknowledged more than 1 s before, and not there."""
    different: int
    """Frames that are not as they were written."""
    opened: bool
    """Whether the file can be opened after recovery."""


def survive(events: list[Event], disk: str, number: int, directory: Path) -> Survived:
    """Cut the power once, and recover."""
    draw = random.Random(f"{disk} {number}")
    found = cut(events, draw.choice(moments(events)), DISKS[disk], draw)
    part = directory / f"{number}.h5.part"
    part.write_bytes(found.content)
    path = directory / f"{number}.h5"
    try:
        with Recording(recover(part)) as recording:
            different = sum(
                not np.array_equal(raw.images, frame(index).images)
                for index, raw in enumerate(recording)
            )
            recovered = recording.frames
        opened = True
    except NotARecording:
        recovered, different, opened = 0, 0, False
    for each in (part, path):
        each.unlink(missing_ok=True)
    lost = max(0, found.must_be_there - recovered)
    return Survived(found.acknowledged, recovered, lost, different, opened)


def measure(directory: Path, *, cuts: int) -> dict[str, list[Survived]]:
    """Cut the power so often for each kind of disk."""
    events = traced(directory / "traced.h5", frames=FRAMES)
    return {
        disk: [survive(events, disk, number, directory) for number in range(cuts)] for disk in DISKS
    }


def tables(*, cuts: int = 100) -> Iterator[Table]:
    """Cut the power so often for each kind of disk."""
    with tempfile.TemporaryDirectory(dir=in_memory()) as name:  # a disk would be waited for
        found = measure(Path(name), cuts=cuts)
    columns = heads(
        "of what was not brought to the disk, there is | cuts | frames acknowledged | "
        "recovered | acknowledged > 1 s before and lost | different | files not opened"
    )
    yield Table("", columns, [_row(disk, each) for disk, each in found.items()])


def _row(disk: str, all_of_it: list[Survived]) -> tuple[str | int, ...]:
    return (
        WHAT[disk],
        len(all_of_it),
        sum(each.acknowledged for each in all_of_it),
        sum(each.recovered for each in all_of_it),
        sum(each.lost for each in all_of_it),
        sum(each.different for each in all_of_it),
        sum(not each.opened for each in all_of_it),
    )
