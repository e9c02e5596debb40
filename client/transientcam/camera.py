"""A camera on the network, as one object."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import httpx

from transientcam.base_camera import BaseCamera
from transientcam.errors import TransientcamError
from transientcam.frame import Frame
from transientcam.lease import Lease
from transientcam.notebook import table_html
from transientcam.requests import (
    MOST_DOCUMENT_BYTES,
    PROGRESS_EVERY_S,
    WAIT_S,
    OnProgress,
    Request,
    document,
    ended,
    problem,
    recording_path,
)
from transientcam.stream import Stream
from transientcam.stream_state import StreamState
from transientcam.transport import (
    DownloadProgress,
    Progress,
    bounded,
    exchange,
    http_client,
    read,
    require_plain,
    set_lease,
    translated,
)

_T = TypeVar("_T")


class Camera(BaseCamera[dict[str, Any], Frame, bytes, Lease, Stream]):
    """A camera behind a daemon.

    ::

        with transientcam.Camera("http://127.0.0.1:8000") as camera:
            range_m = camera.frame("range").array
            for frame in camera.stream("range", "coefficients"):
                ...

    Every method may raise `ServerUnreachable`, `ProblemError` (the daemon refused, with a reason)
    and `ProtocolError`. `AsyncCamera` is its twin for asyncio.

    Parameters
    ----------
    url
        Address of the daemon; http if it has no scheme.
    token
        Bearer token, where the daemon requires one.
    timeout_s
        How long to wait for each answer, all of it.
    transport
        How httpx sends requests, for tests and unusual networks; streams do not take it.
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        timeout_s: float = 10.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        super().__init__(url, token=token, timeout_s=timeout_s)
        self._http = bounded(
            http_client(httpx.Client, token=token, timeout_s=timeout_s, transport=transport)
        )

    @property
    def info(self) -> dict[str, Any]:
        """Names and versions of the daemon."""
        return self._ask(document("info"))

    @property
    def camera(self) -> dict[str, Any]:
        """Capabilities and state of the camera."""
        return self._ask(document("camera"))

    @property
    def sequence(self) -> dict[str, Any]:
        """The sequence that is captured, as it was really set, with its times and rates.

        Assigning a mapping sets it, absent fields to their defaults; `configure` changes single
        fields. The daemon ignores fields that it derives itself, so that a sequence that was read
        can be assigned.
        """
        return self._ask(document("sequence"))

    @sequence.setter
    def sequence(self, settings: Mapping[str, Any]) -> None:
        self._ask(document("sequence", method="PUT", body=settings))

    def configure(self, **changes: object) -> dict[str, Any]:
        """Change some fields of the sequence, keep the others, and return what was really set."""
        return self._ask(document("sequence", method="PUT", body={**self.sequence, **changes}))

    @property
    def reconstruction(self) -> dict[str, Any]:
        """How frames are computed: smoothing, biasing, estimator and thresholds.

        Assigning a mapping changes it from the next frame on, absent fields to their defaults.
        """
        return self._ask(document("reconstruction"))

    @reconstruction.setter
    def reconstruction(self, settings: Mapping[str, Any]) -> None:
        self._ask(document("reconstruction", method="PUT", body=settings))

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters, in ``parameters``, with their values, units and limits."""
        return self._ask(document("parameters"))

    def wait_for(self, job_id: str, *, on_progress: OnProgress | None = None) -> dict[str, Any]:
        """Wait until a job is done or cancelled, and return its document.

        ``on_progress`` is called with the document meanwhile, twice a second.

        Raises
        ------
        ProblemError
            If the job failed.
        """
        wait_s = WAIT_S if on_progress is None else PROGRESS_EVERY_S
        while not ended(job := self.jobs.get(job_id, wait_s=wait_s)):
            if on_progress is not None:
                on_progress(job)
        return job

    @property
    def acquisition(self) -> dict[str, Any]:
        """Whether the camera captures, and how fast."""
        return self._ask(document("acquisition"))

    @property
    def frames(self) -> dict[str, Any]:
        """Numbers of the frames of the last seconds that the daemon still has."""
        return self._ask(document("frames"))

    @property
    def simulation(self) -> dict[str, Any]:
        """The simulated scene and effects; a `ProblemError` if the camera is real."""
        return self._ask(document("simulation"))

    def download_recording(
        self, recording_id: str, output: Path, *, progress: Progress | None = None
    ) -> None:
        """Download a recording's file; until it is complete it is called ``<output>.part``.

        ``progress`` is called with the bytes received so far and their total, None if unknown.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        part = output.with_name(output.name + ".part")
        url = f"{self._address.api}/{recording_path(recording_id)}/file"
        with translated(self.url), self._http.stream("GET", url) as response:
            if response.status_code != httpx.codes.OK:
                raise problem(read(response, most_bytes=MOST_DOCUMENT_BYTES))
            require_plain(response)
            received = DownloadProgress(response, progress)
            with part.open("wb") as file:
                for piece in response.iter_bytes():
                    received.add(file.write(piece))
        part.rename(output)

    def close(self) -> None:
        """Close every connection and stream; the daemon keeps running."""
        for stream in self._streams:
            stream.close()
        self._http.close()

    def __enter__(self) -> "Camera":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        """Return the sequence that is captured as a table, for notebooks; it asks the daemon."""
        try:
            return table_html(repr(self), self.sequence)
        except TransientcamError as error:
            return table_html(repr(self), {"problem": str(error)})

    def _ask(self, request: Request[_T]) -> _T:
        with translated(self.url):
            url = f"{self._address.api}/{request.path}"
            answer = exchange(self._http, url, request, timeout_s=self._timeout_s)
        return request.result(answer)

    def _leased(self, terms: dict[str, Any]) -> Lease:
        return Lease(self._ask, partial(set_lease, self._http.headers), terms)

    def _streaming(self, state: StreamState) -> Stream:
        return Stream(self._address.stream, state, timeout_s=self._timeout_s)
