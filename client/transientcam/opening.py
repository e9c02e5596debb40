"""Open a recording: a file, or one that a daemon keeps.

What reads and computes is part of the daemon's package, so that the numbers are the daemon's; it is
found by its entry point.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import entry_points
from typing import Any, Final, Protocol, cast, overload

import numpy as np
from numpy.typing import NDArray

from transientcam.errors import MissingExtra, ParameterError
from transientcam.frame import Frame
from transientcam.remote_file import RemoteFile
from transientcam.transport import parse_address, without_secrets

GROUP: Final = "transientcam.recordings"
_PATH: Final = "/api/v1/recordings/"
_LIMIT: Final = "the path of a file, or http://HOST:PORT/api/v1/recordings/ID"


class RecordedFrame(Protocol):
    """One frame of a recording; every product by its name is an array: ``range``, ``flags`` ...

    Attributes
    ----------
    number
        From 1, as over HTTP, in ``meta`` and along the axis ``frame`` of arrays and files.
    index
        Its place in the recording, ``number - 1``.
    raw : array, shape (N, H, W), uint16
        Its images in DN.
    range_m : array, shape (H, W)
        The product ``range``, in m.
    meta
        As the daemon's frames have it.
    """

    number: int
    index: int
    raw: NDArray[np.uint16]
    range_m: NDArray[np.float32]
    meta: Mapping[str, Any]

    def product(
        self,
        name: str,
        *,
        time_s: Sequence[float] | None = None,
        bins: int | None = None,
        y: int | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
    ) -> Frame:
        """Return a product with its unit, axes and metadata; parameters as of `Camera.frame`."""
        ...

    def __getattr__(self, name: str) -> Any: ...


class Recording(Protocol):
    """An open recording, a sequence of its frames; nothing is read before it is needed.

    Attributes
    ----------
    sequence
        As it was really set, with its derived fields.
    gains : array, shape (m + 1,) or (m + 1, H, W)
        Complex; what measured moments are divided by: nominal, or of the calibration.
    settings
        Of the reconstruction.
    labels
        Of each image: arrays by name (``harmonic``, ``phase_rad``, ``kind`` ...).
    raw : array-like, shape (frames, N, H, W), uint16
        All images; what is indexed is read.
    frames
        The recording itself, as a sequence of frames.
    """

    sequence: Mapping[str, Any]
    gains: NDArray[Any]
    settings: Mapping[str, Any]
    labels: Mapping[str, NDArray[Any]]
    raw: Any

    @property
    def frames(self) -> "Recording":
        """The recording itself."""
        ...

    def to_xarray(self, *products: str) -> Any:
        """Return an xarray.Dataset that reads and computes what is indexed."""
        ...

    def reconstruct(self, *products: str, bins: int = 256) -> Any:
        """Return an xarray.Dataset of the products of all frames, as Dask arrays."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...

    @overload
    def __getitem__(self, index: int) -> RecordedFrame: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[RecordedFrame]: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[RecordedFrame]: ...
    def __enter__(self) -> "Recording": ...
    def __exit__(self, *error: object) -> None: ...


def open(  # noqa: A001 - it is called as transientcam.open
    path_or_url: str | os.PathLike[str],
    *,
    token: str | None = None,
    settings: Mapping[str, Any] | None = None,
    timeout_s: float = 10.0,
) -> Recording:
    """Open a recording.

    ::

        with transientcam.open("corner.h5") as recording:
            range_m = recording.frames[0].range_m
            later = [frame.direct for frame in recording[10:20]]

    Frames are computed as the daemon computes them, with the gains and the settings that were
    recorded. Of a daemon's recording only what is needed travels.

    Parameters
    ----------
    path_or_url
        A file, also one that is still written (``.part``), or ``URL/api/v1/recordings/ID``.
    token
        Bearer token, where the daemon requires one.
    settings
        Of the reconstruction, by the names of `Camera.reconstruction`, in place of recorded ones.
    timeout_s
        How long to wait for a connection and for each answer.

    Raises
    ------
    MissingExtra
        If the packages that read recordings are not installed.
    ServerUnreachable, ProblemError, ProtocolError
        If the daemon does not have it.
    OSError
        If the file cannot be read.
    """
    opener = _opener()
    place = os.fspath(path_or_url)
    if "://" in place:
        place = _file_url(place)
    return cast("Recording", opener(place, token=token, settings=settings, timeout_s=timeout_s))


def remote_recording(url: str, *, token: str | None = None, timeout_s: float = 10.0) -> RemoteFile:
    """Return the file of a daemon's recording, of which what is read travels.

    ``url``: of the recording, ``URL/api/v1/recordings/ID``, or of its file.
    Raises ParameterError if it is another address.
    Raises ServerUnreachable, ProblemError, ProtocolError if the daemon does not have it.
    """
    return RemoteFile(_file_url(url), token=token, timeout_s=timeout_s)


def _opener() -> Any:
    """Return what opens a file: the first entry point of its group."""
    points = sorted(entry_points(group=GROUP), key=lambda each: each.name)
    try:
        return points[0].load()
    except IndexError:
        raise MissingExtra("transientcam.open", "transientcam_server", "server") from None
    except ModuleNotFoundError as error:
        raise MissingExtra("transientcam.open", error.name or "a package", "server") from error


def _file_url(url: str) -> str:
    """Return the address of a recording's file, of that of the recording."""
    address = parse_address(url).url
    before, found, name = address.rpartition(_PATH)
    recording_id = name.removesuffix("/file")
    if not found or not recording_id or "/" in recording_id:
        raise ParameterError("path_or_url", without_secrets(url), _LIMIT)
    return f"{before}{_PATH}{recording_id}/file"
