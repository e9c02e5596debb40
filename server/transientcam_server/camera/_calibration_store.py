"""The calibrations of a service: one directory of files, and which of them is active.

An id from a client never becomes a path: it is looked up among the files that exist.
"""

import json
import logging
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from transientcam_driver import CalibrationCapture, CalibrationFileError, CalibrationSubject
from transientcam_server.errors import Problem, fenced, kinds
from transientcam_server.imaging import (
    NOMINAL_ID,
    Calibration,
    Verdict,
    evaluate,
    judge,
    load_calibration,
    usable,
)
from transientcam_server.settings import CalibrationSettings

_log = logging.getLogger("transientcam_server.camera.calibration_store")
SUFFIX: Final = ".npz"
_ACTIVE: Final = "active.json"
_ABANDONED_S: Final = 24 * 3600.0


@dataclass(frozen=True, slots=True)
class StoredCalibration:
    """A calibration on disk, without its images."""

    id: str
    path: Path
    """Its file."""
    size_bytes: int
    subject: CalibrationSubject
    """Device and sequence that it fits."""
    model: str
    captured_unix_s: float
    """When its last image arrived."""
    temperature_c: float | None
    notes: Mapping[str, Any]
    """``name``, and what else is stored with it."""
    verdict: Verdict
    """Whether it was measured on a diffuser."""
    waveform: NDArray[Any] | None
    """Harmonics of the modulation (m, K), see `Gains`; None where none are known."""

    @property
    def usable(self) -> bool:
        """Whether it may be activated without being forced: trusted, or forced when measured."""
        return self.verdict.trusted or self.notes.get("forced") is True


class CalibrationStore:
    """The stored calibrations. Reads and writes files, so call it on a worker.

    ``settings``: directory, largest number and size.
    ``given``: file that the service was started with, in any directory.
    """

    def __init__(
        self,
        settings: CalibrationSettings,
        *,
        given: Path | None = None,
        unix_s: Callable[[], float] = time.time,
    ) -> None:
        self._settings = settings
        self._unix_s = unix_s
        self._given = given
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[tuple[int, int], StoredCalibration | None]] = {}

    @property
    def directory(self) -> Path:
        """Directory of the files."""
        return self._settings.directory

    def all(self) -> list[StoredCalibration]:
        """Return every calibration that can be read, the newest first."""
        with self._lock:
            found = {each.id: each for path in self._paths() if (each := self._stored(path))}
        return sorted(found.values(), key=lambda each: each.captured_unix_s, reverse=True)

    def get(self, calibration_id: str) -> StoredCalibration:
        """Return a calibration. Raises Problem ``unknown-calibration``."""
        for each in self.all():
            if each.id == calibration_id:
                return each
        shown = calibration_id[:64]
        raise Problem(
            kinds.UNKNOWN_CALIBRATION,
            f"There is no calibration {shown!r}.",
            field="calibration",
            value=shown,
        )

    def add(self, capture: CalibrationCapture) -> StoredCalibration:
        """Store a measurement. Raises Problem ``calibration-not-stored``."""
        self.require_room()
        with self._part() as part:
            try:
                capture.save(part)
            except OSError as error:
                raise self.not_stored(error) from error
            return self._move_in(part, capture)

    def keep(self, capture: CalibrationCapture) -> None:
        """Store the measurement of another service, which stays as it is where it is here already.

        A failure is only logged: frames can be calibrated by it all the same.
        """
        try:
            self.get(capture.id)
        except Problem:
            try:
                self.add(capture)
            except Problem as problem:
                _log.warning("the calibration %s is not kept: %s", capture.id, problem.detail)

    def import_file(self, part: Path) -> StoredCalibration:
        """Store a file that was received; a calibration that exists stays as it is.

        Raises Problem ``invalid-calibration``, ``calibration-not-stored``.
        """
        try:
            capture = CalibrationCapture.load(part, max_bytes=self._settings.max_bytes)
        except CalibrationFileError as error:
            raise Problem(
                kinds.INVALID_CALIBRATION,
                f"{error.key} is {error.found}, but must be {error.expected}.",
                field=error.key,
                value=str(error.found),
                limit=str(error.expected),
            ) from error
        identity = capture.id
        with suppress(Problem):
            return self.get(identity)
        self.require_room()
        return self._move_in(part, capture)

    def delete(self, calibration_id: str) -> StoredCalibration:
        """Delete a calibration permanently.

        Raises Problem ``unknown-calibration``, ``calibration-in-use`` for the one that the service
        was started with, ``calibration-not-stored`` where the disk refuses.
        """
        stored = self.get(calibration_id)
        if stored.path == self._given:
            raise Problem(
                kinds.CALIBRATION_IN_USE,
                "The service was started with it.",
                field="calibration",
                value=stored.id,
            )
        try:
            stored.path.unlink(missing_ok=True)
        except OSError as error:
            raise self.not_stored(error) from error
        return stored

    @property
    def active_id(self) -> str:
        """The calibration that was active when the service last ran."""
        return self._remembered().get("id") or NOMINAL_ID

    @property
    def former_id(self) -> str | None:
        """The one that was active before that; None where none is known."""
        return self._remembered().get("former")

    def _remembered(self) -> dict[str, str | None]:
        try:
            document = json.loads((self.directory / _ACTIVE).read_text(encoding="utf-8"))
            former = document.get("former")
            return {"id": str(document["id"]), "former": None if former is None else str(former)}
        except FileNotFoundError:
            return {}
        except Exception as error:  # of a file that anybody may have written
            _log.warning("which calibration was active cannot be read: %s", error)
            return {}

    def remember_active(self, calibration_id: str, former_id: str | None) -> None:
        """Keep both for the next start of the service; a failure of the disk is only logged."""
        content = json.dumps({"id": calibration_id, "former": former_id})
        try:
            with self._part() as part:
                part.write_text(content, encoding="utf-8")
                part.replace(self.directory / _ACTIVE)
        except (Problem, OSError) as error:
            _log.warning("the active calibration could not be saved for the next start: %s", error)

    def require_room(self) -> None:
        """Refuse one more calibration where the limit is reached.

        Raises Problem ``calibration-not-stored``.
        """
        most = self._settings.max_count
        if len(self.all()) >= most:
            raise Problem(
                kinds.CALIBRATION_NOT_STORED,
                f"There are {most} calibrations already; delete one.",
                limit=most,
            )

    @contextmanager
    def _part(self) -> Iterator[Path]:
        part = self.new_part()
        try:
            yield part
        finally:
            part.unlink(missing_ok=True)

    def new_part(self) -> Path:
        """Create a file for a calibration that is not complete yet; the caller removes it.

        Raises Problem ``calibration-not-stored``.
        """
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            self._sweep()
            descriptor, name = tempfile.mkstemp(suffix=".part", dir=self.directory)
        except OSError as error:
            raise self.not_stored(error) from error
        os.close(descriptor)
        return Path(name)

    def not_stored(self, error: OSError) -> Problem:
        """Return the problem of a failed write, and log the directory."""
        _log.warning("storing a calibration in %s failed: %s", self.directory, error)
        reason = error.strerror or "no reason is given"
        return Problem(kinds.CALIBRATION_NOT_STORED, f"It could not be written: {reason}.")

    def _sweep(self) -> None:
        """Remove files that a service left when it died while it received them."""
        for part in self.directory.glob("*.part"):
            with suppress(FileNotFoundError):  # its owner removed it first
                if part.stat().st_mtime < self._unix_s() - _ABANDONED_S:
                    part.unlink()

    def _move_in(self, part: Path, capture: CalibrationCapture) -> StoredCalibration:
        path = self.directory / (capture.id + SUFFIX)
        try:
            with part.open("rb") as file:
                os.fsync(file.fileno())
            part.replace(path)
        except OSError as error:
            raise self.not_stored(error) from error
        return self.get(capture.id)

    def _paths(self) -> list[Path]:
        try:
            kept = sorted(self.directory.glob(f"*{SUFFIX}"))
        except OSError as error:
            _log.warning("the calibrations cannot be listed: %s", error)
            kept = []
        return kept if self._given is None else [*kept, self._given]

    def _stored(self, path: Path) -> StoredCalibration | None:
        try:
            status = path.stat()
        except OSError:  # deleted this moment
            return None
        stamp = status.st_mtime_ns, status.st_size
        known = self._known.get(path)
        if known is None or known[0] != stamp:
            known = self._known[path] = stamp, _read(path, status.st_size)
        return known[1]


def _read(path: Path, size_bytes: int) -> StoredCalibration | None:
    def unreadable(reason: str) -> None:
        _log.warning("%s is not readable: %s", path, reason)

    return fenced(lambda path: _loaded(path, size_bytes), path, unreadable)


def _loaded(path: Path, size_bytes: int) -> StoredCalibration | None:
    capture = CalibrationCapture.load(path)
    return StoredCalibration(
        id=capture.id,
        path=path,
        size_bytes=size_bytes,
        subject=capture.subject,
        model=capture.model,
        captured_unix_s=capture.captured_unix_s,
        temperature_c=capture.temperature_c,
        notes=dict(capture.notes),
        verdict=verdict_of(capture),
        waveform=usable(capture.waveform),
    )


def load_given(path: Path) -> Calibration:
    """Read and evaluate a file that a request names, unless it was not measured on a diffuser.

    Raises CalibrationFileError where the file holds none; Problem ``calibration-doubted``.
    """
    calibration = load_calibration(path)
    verdict = verdict_of(calibration.capture)
    if not verdict.trusted and calibration.capture.notes.get("forced") is not True:
        raise doubted(verdict, f"{path}: ")
    return calibration


def doubted(verdict: Verdict, named: str = "") -> Problem:
    """Return the problem of a calibration that was not measured on a diffuser."""
    return Problem(
        kinds.CALIBRATION_DOUBTED,
        f"{named}{verdict.reason}",
        field="calibration",
        verdict=verdict.word,
        tests=verdict.to_document()["tests"],
    )


def verdict_of(capture: CalibrationCapture) -> Verdict:
    """Return the verdict that was stored with a measurement, or judge it now."""
    stored = Verdict.from_document(capture.notes.get("verdict"))
    return stored or judge(capture, evaluate(capture).gains.bad)
