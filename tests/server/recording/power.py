"""Power cuts: what a writer wrote, as strace saw it, and what a disk may have kept of it.

``python -m tests.server.recording.power FILE FRAMES`` is the writer: 10 frames a second by its own
clock, brought to the disk as the recorder does, a line after each frame that is acknowledged.
"""

import os
import random
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.conftest import ROOT
from tests.server.recording.made import frame, header
from transientcam_server.recording import RecordingWriter

RATE_HZ: Final = 10.0
SECTOR_BYTES: Final = 512
_CALL: Final = re.compile(r"^\d+ +(\w+)\((.*)\) += (\d+)$")
_PATH: Final = re.compile(r"^\d+<(.*?)>(?:, ?)?")


@dataclass(frozen=True)
class Write:
    """Bytes written at a place of the file."""

    offset: int
    data: bytes


@dataclass(frozen=True)
class Synchronised:
    """All before is on the disk."""


@dataclass(frozen=True)
class Acknowledged:
    """So many frames are acknowledged."""

    frames: int


@dataclass(frozen=True)
class Stated:
    """So many frames are stated to be on the disk."""

    frames: int


@dataclass(frozen=True)
class Renamed:
    """The file has its final name; until the directory is synchronised, maybe not on the disk."""


Event = Write | Synchronised | Acknowledged | Stated | Renamed


def traced(path: Path, *, frames: int) -> list[Event]:
    """Record so many frames in another process, and return what it did to the file, in order."""
    log = path.with_name("calls")
    subprocess.run(
        [
            *("strace", "-f", "-y", "-xx", "-s", "100000000", "-o", str(log)),
            *("-e", "trace=write,pwrite64,fsync,ftruncate,rename,renameat2", "-e", "signal=none"),
            *(sys.executable, "-m", "tests.server.recording.power", str(path), str(frames)),
        ],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    return list(_events(log.read_text(encoding="ascii").splitlines(), path.name))


def _events(lines: list[str], name: str) -> Iterator[Event]:
    part, names = name + ".part", (name + ".scratch", name + ".part")
    position = 0
    for line in lines:
        call = _CALL.match(line)
        if call is None:
            continue
        what, arguments, _ = call.groups()
        place = _PATH.match(arguments)
        there = "" if place is None else _bytes(place[1]).decode()
        rest = "" if place is None else arguments[place.end() :]
        if what in ("rename", "renameat2"):
            if _bytes(arguments).decode("latin-1").partition('", ')[0].endswith(part):
                yield Renamed()
        elif what == "write" and arguments.startswith("1<"):
            if (said := _bytes(rest.split('"')[1]).strip()).isdigit():  # not by a child of NumPy's
                yield Acknowledged(int(said))
            elif said.startswith(b"synced "):
                yield Stated(int(said.split()[1]))
        elif not there.endswith(names):
            continue
        elif what == "fsync":
            yield Synchronised()
        elif what == "write":
            data = _bytes(rest.split('"')[1])
            yield Write(position, data)
            position += len(data)
        elif what == "pwrite64":
            yield Write(int(rest.rpartition(",")[2]), _bytes(rest.split('"')[1]))
        else:
            raise ValueError(f"{what} is not understood")


def _bytes(text: str) -> bytes:
    return re.sub(r"\\x(..)", lambda each: chr(int(each[1], 16)), text).encode("latin-1")


Keep = Callable[[list[Write], random.Random], list[Write]]


def nothing(pending: list[Write], draw: random.Random) -> list[Write]:
    """Lose all since the file was brought to the disk."""
    return []


def everything(pending: list[Write], draw: random.Random) -> list[Write]:
    """Lose nothing, as when only the process dies."""
    return pending


def in_order(pending: list[Write], draw: random.Random) -> list[Write]:
    """Keep the first writes, and of the next one the first sectors."""
    if not pending:
        return []
    count = draw.randrange(len(pending))
    pieces = list(_sectors(pending[count]))
    return pending[:count] + pieces[: draw.randrange(len(pieces) + 1)]


def in_pieces(size_bytes: int) -> Keep:
    """Keep of every piece of the disk any version that it had, whatever the others have."""

    def keep(pending: list[Write], draw: random.Random) -> list[Write]:
        versions: dict[int, int] = {}
        pieces = [piece for each in pending for piece in _sectors(each)]
        for piece in pieces:
            at = piece.offset // size_bytes
            versions[at] = versions.get(at, 0) + 1
        kept = {at: draw.randrange(count + 1) for at, count in versions.items()}
        found = []
        for piece in pieces:
            at = piece.offset // size_bytes
            if kept[at]:
                kept[at] -= 1
                found.append(piece)
        return found

    return keep


def _sectors(write: Write) -> Iterator[Write]:
    """Split a write where the disk does."""
    at = write.offset
    end = at + len(write.data)
    while at < end:
        stop = min(end, (at // SECTOR_BYTES + 1) * SECTOR_BYTES)
        yield Write(at, write.data[at - write.offset : stop - write.offset])
        at = stop


DISKS: Final[dict[str, Keep]] = {
    "nothing": nothing,
    "everything": everything,
    "in order, torn": in_order,
    "pages in any order": in_pieces(4096),
    "sectors in any order": in_pieces(SECTOR_BYTES),
}
"""What a disk may keep of what was written since the last fsync."""


@dataclass(frozen=True)
class Cut:
    """The power is cut before an event: what was acknowledged, and what the disk has."""

    acknowledged: int
    stated: int
    content: bytes

    @property
    def must_be_there(self) -> int:
        """Frames stated to be on the disk, and those acknowledged more than a second before.

        The last one is just acknowledged.
        """
        return max(self.stated, self.acknowledged - int(RATE_HZ))


def cut(events: list[Event], at: int, keep: Keep, draw: random.Random) -> Cut:
    """Cut the power before an event."""
    acknowledged = stated = 0
    content = bytearray()
    pending: list[Write] = []
    for event in events[:at]:
        match event:
            case Acknowledged(frames):
                acknowledged = frames
            case Stated(frames):
                stated = frames
            case Write():
                pending.append(event)
            case Synchronised():
                _apply(pending, content)
                pending.clear()
    _apply(keep(pending, draw), content)
    return Cut(acknowledged, stated, bytes(content))


def _apply(writes: list[Write], content: bytearray) -> None:
    for each in writes:
        end = each.offset + len(each.data)
        content.extend(bytes(max(0, end - len(content))))
        content[each.offset : end] = each.data


def moments(events: list[Event]) -> range:
    """Return the places of events from the second fsync, with which it starts, to its name."""
    first = [at for at, event in enumerate(events) if isinstance(event, Synchronised)][1]
    last = next(at for at, event in enumerate(events) if isinstance(event, Renamed))
    return range(first + 1, last + 1)


def main() -> None:
    """Record frames, and say after each that it is acknowledged."""
    path, frames = Path(sys.argv[1]), int(sys.argv[2])
    writer = RecordingWriter(path, header())
    for number in range(frames):
        writer.append(frame(number))
        os.write(1, b"%d\n" % (number + 1))
        writer.synchronise((number + 1) / RATE_HZ)
        os.write(1, b"synced %d\n" % writer.synchronised_frames)
    writer.close({"reason": "stopped"})


if __name__ == "__main__":
    main()
