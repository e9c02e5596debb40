"""Reads recordings, finished or not: every frame as the camera gave it."""

import contextlib
import math
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import RawFrame
from transientcam_driver.camera import capture_times
from transientcam_server.errors import DamagedFrame, NotARecording
from transientcam_server.recording import _layout as layout, _lock as lock, _swmr as swmr
from transientcam_server.recording._heaps import CheckedReader, require_sound_heaps
from transientcam_server.recording._readers import READERS
from transientcam_server.recording._storage import Storage, read_rows


class Recording:
    """An open recording, read-only; its methods may be called from any thread.

    One that is still being written, or whose writer died, shows the frames it had when it was
    opened.

    ``path``: of the file.
    ``source``: an open binary file with what stands at ``path``, where that is elsewhere; closed
    with the recording.
    Raises NotARecording if the file cannot be read as one; OSError if there is no such file, or it
    may not be read.
    """

    def __init__(self, path: Path, *, source: IO[bytes] | None = None) -> None:
        self.path = path
        self._open = contextlib.ExitStack()
        # the system's errors are clearer than h5py's
        stream = self._open.enter_context(path.open("rb") if source is None else source)
        try:
            checked = self._open.enter_context(CheckedReader(stream))
        except OSError:
            self.close()
            raise
        try:
            # the writer of an unfinished one may still run: only SWMR readers may open it
            unfinished = source is None and path.name.endswith(".part")
            if unfinished and not lock.is_taken(path):  # nor is it read by a recovery
                require_sound_heaps(stream)
            if unfinished:
                self._open.enter_context(READERS.reading(path))
            opened = swmr.open_unfinished(path) if unfinished else swmr.open_file(checked, "r")
            self._file = self._open.enter_context(opened)
            storage = Storage(self._file, checked.size_bytes)
            self.header = layout.read_header(storage)
            self.labels = layout.read_labels(storage, self.header.applied)
            self._series = layout.read_series(storage)
            self.annotations = layout.read_document(storage, "annotations")
            """What people wrote about it, as JSON."""
            self.end = layout.read_end(storage)
            """How it ended; empty while it has not, or when its writer died."""
            if source is None and not unfinished:
                # its texts are read: images come faster without a look at every byte
                self._file.close()
                self._file = self._open.enter_context(swmr.open_file(path, "r"))
                storage = Storage(self._file, checked.size_bytes)
            self._raw = storage.dataset("raw", axes=4)
        except FileNotFoundError:  # it was finished, or deleted, this moment
            self.close()
            raise
        except Exception as error:  # h5py raises anything of a damaged file
            self.close()
            raise NotARecording(str(path), _reason(error)) from error
        self.frames = min(len(self._raw), *map(len, self._series.values()))
        """How many frames it has."""

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Frames, images of a frame, height and width."""
        images, height, width = self._raw.shape[1:]
        return self.frames, images, height, width

    @property
    def stored(self) -> swmr.Dataset:
        """The images as HDF5 has them; see `transientcam_server.recording._storage`."""
        return self._raw

    @property
    def descriptor(self) -> int:
        """Descriptor of the open file, also after it got another name."""
        return int(self._file.id.get_vfd_handle())

    def series(self, name: str) -> NDArray[Any]:
        """Return one of `layout.SERIES`, or ``frame``, one value a frame."""
        values: NDArray[Any] = self._series[name][: self.frames]
        return values

    @cached_property
    def captured_unix_s(self) -> NDArray[np.float64]:
        """When the first exposure of each frame began, in Unix time."""
        if self.header.capabilities.clock == "ptp":
            return self.series("device_time_s")
        return capture_times(*map(self.series, ("device_time_s", "capture_s", "host_time_s")))

    def frame(self, index: int) -> RawFrame:
        """Return a frame, bit for bit as it was captured.

        Raises DamagedFrame if its bytes are not the ones that were written; IndexError if there is
        none; ValueError if the file was closed.
        """
        if not self._file:
            raise ValueError(f"{self.path} is closed")
        if not 0 <= index < self.frames:
            raise IndexError(f"frame {index} of {self.frames}")
        images = self._images(index)
        if layout.checksum(images) != self._series["crc32"][index]:
            raise DamagedFrame(str(self.path), index + 1, "its checksum does not hold")
        value = {name: values[index].item() for name, values in self._series.items()}
        return RawFrame(
            number=value["device_frame"],
            epoch=value["epoch"],
            images=images,
            labels=self.labels,
            device_time_s=value["device_time_s"],
            host_time_s=value["host_time_s"],
            capture_s=value["capture_s"],
            temperature_c=None if math.isnan(value["temperature_c"]) else value["temperature_c"],
            lost_images=value["lost_images"],
            captured_unix_s=float(self.captured_unix_s[index]),
        )

    def __iter__(self) -> Iterator[RawFrame]:
        for index in range(self.frames):
            yield self.frame(index)

    def __len__(self) -> int:
        return self.frames

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(Exception):  # of a damaged one
            self._open.close()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _images(self, index: int) -> NDArray[np.uint16]:
        try:
            images = read_rows(self._raw, index, index + 1)[0]
        except Exception as error:  # h5py raises anything of a damaged file
            raise DamagedFrame(str(self.path), index + 1, _reason(error)) from error
        native: NDArray[np.uint16] = images.astype(np.uint16, copy=False)
        return native


def _reason(error: Exception) -> str:
    """Return the reason in a message of HDF5: ``Unable to ... (the reason, and numbers)``."""
    text = str(error).partition("\n")[0]
    if text.startswith(("Unable to", "Can't")):
        text = text.partition("(")[2].rstrip(")").partition(",")[0]
    return text or type(error).__name__
