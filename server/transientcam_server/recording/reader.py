"""Reads recordings, finished or not: every frame as the camera gave it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import DriverError, RawFrame
from transientcam_server.errors.exceptions import DamagedFrame, NotARecording
from transientcam_server.recording import layout, swmr


class Recording:
    """An open recording, read-only; its methods may be called from any thread.

    One that is still being written, or whose writer died, shows the frames it had when it was
    opened.

    Parameters
    ----------
    path
        Of the file.
    source
        An open binary file with what stands at ``path``, where that is elsewhere; closed with the
        recording.

    Raises
    ------
    NotARecording
        If the file cannot be read as one.
    OSError
        If there is no such file, or it may not be read.
    """

    def __init__(self, path: Path, *, source: IO[bytes] | None = None) -> None:
        self.path = path
        self._source = source
        if source is None:
            with path.open("rb"):
                pass  # its errors are clearer than h5py's
        try:
            # the writer of an unfinished one may still run: only SWMR readers may open it
            unfinished = source is None and path.name.endswith(".part")
            self._file = swmr.open_file(source or path, "r", libver="latest", swmr=unfinished)
        except OSError as error:
            raise NotARecording(str(path), _reason(error)) from error
        try:
            self.header = layout.read_header(self._file)
            self.labels = layout.read_labels(self._file)
            self._raw = self._file["raw"]
            self._series = {name: self._file[name][()] for name in layout.SERIES}
        except (KeyError, TypeError, ValueError, OSError, RuntimeError, DriverError) as error:
            self.close()
            raise NotARecording(str(path), _reason(error)) from error
        self.frames = min(len(self._raw), *map(len, self._series.values()))
        """How many frames it has."""
        self._as_written = (
            self._raw.chunks == (1, *self._raw.shape[1:])
            and self._raw.compression == "gzip"
            and self._raw.shuffle
            and not self._raw.fletcher32
        )

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Frames, images of a frame, height and width."""
        images, height, width = self._raw.shape[1:]
        return self.frames, images, height, width

    @property
    def annotations(self) -> dict[str, Any]:
        """Its annotations, as JSON."""
        return layout.read_document(self._file, "annotations")

    @property
    def end(self) -> dict[str, Any]:
        """How it ended; empty while it has not, or when its writer died."""
        return layout.read_document(self._file, "end")

    def series(self, name: str) -> NDArray[Any]:
        """Return one of `layout.SERIES`, one value a frame."""
        values: NDArray[Any] = self._series[name][: self.frames]
        return values

    def frame(self, index: int) -> RawFrame:
        """Return a frame, bit for bit as it was captured.

        Raises
        ------
        DamagedFrame
            If its bytes are not the ones that were written.
        IndexError
            If there is none.
        ValueError
            If the file was closed.
        """
        if not self._file:
            raise ValueError(f"{self.path} is closed")
        if not 0 <= index < self.frames:
            raise IndexError(f"frame {index} of {self.frames}")
        images = self._images(index)
        if layout.checksum(images) != self._series["crc32"][index]:
            raise DamagedFrame(str(self.path), index, "its checksum does not hold")
        value = {name: values[index].item() for name, values in self._series.items()}
        return RawFrame(
            number=value["frame"],
            epoch=value["epoch"],
            images=images,
            labels=self.labels,
            device_time_s=value["device_time_s"],
            host_time_s=value["host_time_s"],
            capture_s=value["capture_s"],
            temperature_c=value["temperature_c"],
            lost_images=value["lost_images"],
        )

    def __iter__(self) -> Iterator[RawFrame]:
        for index in range(self.frames):
            yield self.frame(index)

    def __len__(self) -> int:
        return self.frames

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(RuntimeError):  # of a damaged one
            self._file.close()
        if self._source is not None:
            self._source.close()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _images(self, index: int) -> NDArray[np.uint16]:
        try:
            if not self._as_written:
                images: NDArray[np.uint16] = self._raw[index]
                return images
            # past HDF5's filters, which take five times as long under a lock of the whole process
            _, chunk = self._raw.id.read_direct_chunk((index, 0, 0, 0))
            return swmr.expanded(chunk, self._raw.shape[1:], np.dtype("<u2"))
        except (OSError, RuntimeError, ValueError) as error:
            raise DamagedFrame(str(self.path), index, _reason(error)) from error


def _reason(error: Exception) -> str:
    """Return the reason in a message of HDF5: ``Unable to ... (the reason, and numbers)``."""
    text = str(error).partition("\n")[0]
    _, opened, inner = text.partition("(")
    return (inner.rstrip(")").partition(",")[0] if opened else text) or type(error).__name__
