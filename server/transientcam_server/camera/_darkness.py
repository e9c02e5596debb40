"""Why the light of a camera is off, kept on the disk over the end of the service."""

import hashlib
import logging
import os
import tempfile
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

_log = logging.getLogger("transientcam_server.camera.darkness")
KeptCause = Literal["stop", "safe-off", "lapse", "device", "unused", "unserved", "supervisor"]
Cause = KeptCause | Literal["start", "unreadable", "unwritable"]
RETRY_S: Final = 1.0
CLOSE_S: Final = 2.0
_MOST_BYTES: Final = 64 * 1024
_UNTIL: Final = "off until the capture is started"
_WORDS: Final[dict[Cause, str]] = {
    "start": "the service starts no capture by itself (setting capture_at_start)",
    "stop": "the capture was stopped",
    "safe-off": "the light was switched off",
    "lapse": "a lease lapsed",
    "device": "the device keeps its light off",
    "unused": "nobody used the capture",
    "unserved": "no client could have switched the light off",
    "supervisor": "the process that watches the light switched it off",
    "unreadable": "what is kept of the light cannot be read",
    "unwritable": "that the light is off could not be kept",
}


@dataclass(frozen=True, slots=True)
class Dark:
    """That the light is off, and why; ``detail`` says more than the cause."""

    cause: Cause
    detail: str = ""

    def __str__(self) -> str:
        """Return the reason in words."""
        detail = f": {self.detail}" if self.detail else ""
        return f"{_WORDS[self.cause]}{detail}; {_UNTIL}"


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    camera: str
    dark: KeptCause | None
    detail: str = ""


class Darkness:
    """Keeps why the light of one camera is off; a thread writes, so that no disk delays the light.

    ``directory``: of the files of all cameras.
    ``camera``: which of them.
    ``retry_s``: pause after a failed write.
    ``written``: done once the disk holds what was told last.
    """

    def __init__(self, directory: Path, camera: str, *, retry_s: float = RETRY_S) -> None:
        self._camera = _plain(camera)
        digest = hashlib.sha256(self._camera.encode()).hexdigest()
        self._path = directory / f"{digest[:16]}.json"
        self._retry_s = retry_s
        self._changed = threading.Condition()
        self._told: Dark | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="darkness", daemon=True)
        self.written: Future[None] = Future()
        self.written.set_result(None)

    def open(self) -> Dark | None:
        """Return why the light was off when the service last ran, None where it was not.

        A file that cannot be read counts as dark, and so does one that cannot be written: the next
        safe-off would be forgotten.
        """
        found = self._read()
        if found is None or found.cause != "unreadable":  # what is damaged stays to be looked at
            try:
                self._write(found)
            except OSError as error:
                self.written = Future()
                found = found or Dark("unwritable", f"{self._path}: {error.strerror or error}")
        self._thread.start()
        return found

    def keep(self, dark: Dark | None) -> None:
        """Keep this, None for a capture that was started; a failure is logged, and tried again."""
        with self._changed:
            self._told, self.written = dark, Future()
            self._changed.notify()

    def close(self) -> None:
        """Write what was told last, unless the disk hangs."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        if self._thread.ident is not None:
            self._thread.join(CLOSE_S)

    def _read(self) -> Dark | None:
        try:
            with self._path.open("rb") as file:
                document = _Document.model_validate_json(file.read(_MOST_BYTES))
        except FileNotFoundError:
            return None
        except OSError as error:
            return Dark("unreadable", f"{self._path}: {error.strerror or error}")
        except ValidationError:
            return Dark("unreadable", f"{self._path} is damaged")
        return None if document.dark is None else Dark(document.dark, document.detail)

    def _run(self) -> None:
        written = self.written
        while True:
            with self._changed:
                while self.written is written:
                    if self._closing:
                        return
                    self._changed.wait()
                told, dark = self.written, self._told
            try:
                self._write(dark)
            except OSError as error:
                _log.error("%s: that the light is off is not kept: %s", self._path, error)
                with self._changed:
                    if self._closing:
                        return
                    self._changed.wait(self._retry_s)
                continue
            written = told
            told.set_result(None)

    def _write(self, dark: Dark | None) -> None:
        """Replace the file as a whole.

        It is replaced before it is synchronised: a process that is killed leaves it at once, and
        what a loss of power leaves of it is whole, or damaged, which counts as dark.
        """
        cause, detail = (None, "") if dark is None else (dark.cause, _plain(dark.detail))
        content = {"camera": self._camera, "dark": cause, "detail": detail}
        data = _Document.model_validate(content).model_dump_json().encode()
        directory = self._path.parent
        directory.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=directory, prefix=self._path.stem, suffix=".part")
        with os.fdopen(handle, "wb") as file:
            try:
                file.write(data)
                file.flush()
                Path(name).replace(self._path)
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            os.fsync(file.fileno())
        of_directory = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(of_directory)
        finally:
            os.close(of_directory)


def _plain(text: str) -> str:
    """Return a text that can be encoded, whatever a command line or a device gave."""
    return text.encode("utf-8", "backslashreplace").decode()
