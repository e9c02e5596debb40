"""Disks that fail: the n-th write or fsync of this process, once or from there on.

``python -m tests.server.recording.failing`` tries every place with every fault and prints the
counts; ``--below`` does so below Python, where strace makes the system's calls fail.
"""

import argparse
import errno
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from unittest import mock

from tests.conftest import ROOT
from tests.server.recording.made import APPLIED, assert_same, frame, header
from transientcam_server.recording import Recording, RecordingWriter, _layout as layout, recover
from transientcam_server.recording._recorder import Limits, Recorder

FRAMES: Final = 10
FAULTS: Final = ("EIO", "ENOSPC", "short")
CALLS: Final = ("write", "pwrite", "fsync", "ftruncate")
_FRAMES: Final = [frame(number) for number in range(FRAMES)]
_HEADER: Final = header()
_IMAGES: Final[dict[str, bytes]] = {}
_MADE: Final = layout.image


@dataclass(frozen=True)
class Fault:
    """What the disk does at a call, counted from 1, or from there on; 0 for nothing."""

    at: int = 0
    kind: str = "EIO"
    for_ever: bool = False

    @property
    def words(self) -> str:
        """What the system calls it."""
        return os.strerror(getattr(errno, "ENOSPC" if self.kind == "short" else self.kind))


class FailingDisk:
    """Counts what this process writes, and makes it fail."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        self.calls = 0

    @contextmanager
    def inserted(self) -> Iterator["FailingDisk"]:
        """Put it between this process and the system."""
        failing: dict[str, Any] = {name: self._around(getattr(os, name)) for name in CALLS}
        with mock.patch.multiple(os, **failing):
            yield self

    def _around(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def failing(descriptor: int, *arguments: Any) -> Any:
            self.calls += 1
            fault = self.fault
            after = self.calls - fault.at if fault.at else -1
            if after < 0 or (after and not fault.for_ever):
                # what a disk would keep of it is another question, and it takes long
                return None if call.__name__ == "fsync" else call(descriptor, *arguments)
            if fault.kind == "short" and call.__name__.endswith("write") and not after:
                data, *place = arguments  # the first part fits, nothing after it does
                return call(descriptor, memoryview(data)[: len(data) // 2], *place)
            number = errno.ENOSPC if fault.kind == "short" else getattr(errno, fault.kind)
            raise OSError(number, os.strerror(number))

        return failing


def record(directory: Path) -> Recorder:
    """Record `FRAMES`, brought to the disk every few of them; an OSError if it cannot begin."""
    ticks = itertools.count()
    recorder = Recorder(
        RecordingWriter(directory / "a.h5", _HEADER),
        _HEADER,
        limits=Limits(),
        queue_frames=FRAMES,
        free_bytes=lambda: 1 << 40,
        clock=lambda: 0.25 * next(ticks),
    )
    for each in _FRAMES:
        recorder.offer(each, APPLIED)
    recorder.stop()
    recorder.start()
    recorder.wait()
    return recorder


def tried(directory: Path, fault: Fault) -> str:
    """Record on such a disk, hold what is left against what was counted; return how it ended."""
    with mock.patch.object(layout, "image", _image):
        return _tried(directory, fault)


def _tried(directory: Path, fault: Fault) -> str:
    refused = None
    with FailingDisk(fault).inserted():
        try:
            recorder = record(directory)
        except OSError as error:
            refused = error.strerror
    if refused is not None:
        assert refused == fault.words
        assert list(directory.iterdir()) == []
        return "refused"
    progress = recorder.progress
    part = directory / "a.h5.part"
    if progress.reason == "failed":
        assert progress.problem == fault.words
    else:
        assert not part.exists()
        assert progress.frames == FRAMES
    require_kept(directory, progress.frames)
    return str(progress.reason)


def require_kept(directory: Path, counted: int) -> None:
    """Require every counted frame, and that every frame is as it was."""
    part = directory / "a.h5.part"
    path = recover(part) if part.exists() else directory / "a.h5"
    with Recording(path) as recording:
        assert recording.frames >= counted
        for raw, wanted in zip(recording, _FRAMES, strict=False):
            assert_same(raw, wanted)
    path.unlink()


def _image(*of: Any) -> bytes:
    """Return what a file begins with, made once for each header: making it takes longest."""
    if repr(of) not in _IMAGES:
        _IMAGES[repr(of)] = _MADE(*of)
    return _IMAGES[repr(of)]


def calls(directory: Path) -> int:
    """Return how many calls a recording takes on a disk that works."""
    with FailingDisk(Fault()).inserted() as disk, mock.patch.object(layout, "image", _image):
        record(directory)
    require_kept(directory, FRAMES)
    return disk.calls


# -- below Python ------------------------------------------------------------------------------


def tried_below(directory: Path, fault: Fault) -> str:
    """Do as `tried` in a process whose calls the system answers with the error."""
    when = f"{fault.at}{'+' if fault.for_ever else ''}"
    trace = "write,pwrite64,fsync,ftruncate"
    names = [directory / f"a.h5{suffix}" for suffix in ("", ".part", ".scratch")]
    done = subprocess.run(
        [
            *("strace", "-f", "-qq", "-o", "/dev/null", "-e", f"trace={trace}"),
            *("-e", f"inject={trace}:error={fault.kind}:when={when}", "-e", "signal=none"),
            *itertools.chain.from_iterable(("-P", str(each)) for each in [*names, directory]),
            *(sys.executable, "-m", "tests.server.recording.failing", "--record", str(directory)),
        ],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        capture_output=True,
        check=False,
    )
    said = done.stdout.decode().split()
    assert done.returncode == 0, (fault, done.returncode, done.stderr.decode()[-2000:])
    if said == ["refused"]:
        assert list(directory.iterdir()) == []
        return said[0]
    require_kept(directory, int(said[0]))
    return said[1]


def main() -> None:
    """Try every place, with every fault, once and for ever."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--below", action="store_true")
    options.add_argument("--every", type=int, default=1, help="try each so-manieth place")
    options.add_argument("--record", type=Path)
    chosen = options.parse_args()
    if chosen.record is not None:
        try:
            recorder = record(chosen.record)
        except OSError:
            sys.stdout.write("refused\n")
        else:
            sys.stdout.write(f"{recorder.progress.frames} {recorder.progress.reason}\n")
        return
    place = Path(tempfile.mkdtemp())
    try:
        count, ended = calls(place), Counter[str]()
        kinds = FAULTS[:2] if chosen.below else FAULTS
        run = tried_below if chosen.below else tried
        for at in range(1, count + 1, chosen.every):
            for kind, for_ever in itertools.product(kinds, (False, True)):
                ended[run(place, Fault(at, kind, for_ever))] += 1
        sys.stdout.write(f"{count} places, {sum(ended.values())} recordings: {dict(ended)}\n")
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    main()
