"""A camera on the network, as one object."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import httpx

from transientcam.frame import Frame
from transientcam.lease import Lease, OnLapse
from transientcam.requests import frames as frame_requests
from transientcam.requests import request as rest
from transientcam.requests.calibrations import Calibrations
from transientcam.requests.frames import Part, Which
from transientcam.requests.jobs import PROGRESS_EVERY_S, WAIT_S, Jobs, OnProgress, ended
from transientcam.stream import Stream
from transientcam.stream_state import (
    DEFAULT_CREDITS,
    NoticeHandler,
    Reconnect,
    StreamState,
    reconnect_policy,
    subscribe_message,
)
from transientcam.transport.address import parse_address
from transientcam.transport.errors import translated
from transientcam.transport.options import Progress, Told, answer, http_options, request_options
from transientcam.wire import LEASE_HEADER, Subscription

_T = TypeVar("_T")


class Camera:
    """A camera behind a daemon.

    ::

        with transientcam.Camera("http://127.0.0.1:8000") as camera:
            range_m = camera.frame("range").array
            for frame in camera.stream("range", "coefficients"):
                ...

    Every method may raise `ServerUnreachable`, `ProblemError` (the daemon refused, and says why)
    and `ProtocolError`. `AsyncCamera` is its twin for asyncio.

    Parameters
    ----------
    url
        Address of the daemon; http unless it says https.
    token
        What proves who asks, where the daemon wants that.
    timeout_s
        How long to wait for a connection and for each answer.
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
        self._address = parse_address(url)
        self._token = token
        self._timeout_s = timeout_s
        self._http = httpx.Client(
            **http_options(token=token, timeout_s=timeout_s), transport=transport
        )
        self._streams: list[Stream] = []

    @property
    def url(self) -> str:
        """Address of the daemon."""
        return self._address.url

    @property
    def info(self) -> dict[str, Any]:
        """What the daemon is: names and versions."""
        return self._ask(rest.document("info"))

    @property
    def camera(self) -> dict[str, Any]:
        """What the camera is, can do and does: capabilities and state."""
        return self._ask(rest.document("camera"))

    @property
    def sequence(self) -> dict[str, Any]:
        """What is captured: the sequence as it was really set, with its times and rates.

        Assigning a mapping sets it, what is left out to its default; `configure` changes single
        fields. What the daemon added to a sequence that was read is ignored.
        """
        return self._ask(rest.document("sequence"))

    @sequence.setter
    def sequence(self, settings: Mapping[str, Any]) -> None:
        self._ask(rest.sequence(settings))

    def configure(self, **changes: object) -> dict[str, Any]:
        """Change some fields of the sequence, keep the others, and return what was really set."""
        return self._ask(rest.sequence({**self.sequence, **changes}))

    def validate(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Return what a sequence would really be set to, without setting it."""
        return self._ask(rest.sequence(settings, only_validate=True))

    @property
    def reconstruction(self) -> dict[str, Any]:
        """How frames are computed: smoothing, biasing, estimator and thresholds.

        Assigning a mapping changes it from the next frame on, what is left out to its default.
        """
        return self._ask(rest.document("reconstruction"))

    @reconstruction.setter
    def reconstruction(self, settings: Mapping[str, Any]) -> None:
        self._ask(rest.reconstruction(settings))

    @property
    def parameters(self) -> dict[str, Any]:
        """Everything that can be set, in ``parameters``, with its value, unit and limits."""
        return self._ask(rest.document("parameters"))

    @property
    def calibrations(self) -> Calibrations[dict[str, Any], bytes]:
        """The calibrations that the daemon keeps: to measure, use, export and take in."""
        return Calibrations(self._ask, self._ask)

    @property
    def jobs(self) -> Jobs[dict[str, Any]]:
        """Long work of the daemon: how far it is, and how to end it."""
        return Jobs(self._ask)

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
        return self._ask(rest.document("acquisition"))

    def start(self) -> dict[str, Any]:
        """Let the camera capture."""
        return self._ask(rest.acquire(running=True))

    def stop(self) -> dict[str, Any]:
        """Let the camera rest."""
        return self._ask(rest.acquire(running=False))

    def lease(
        self,
        holder: str,
        *,
        duration_s: float = 30.0,
        on_lapse: OnLapse = "stop",
        takeover: bool = False,
    ) -> Lease:
        """Return a block in which nobody else changes anything.

        ::

            with camera.lease("alignment on bench 2"):
                camera.configure(harmonics=4)

        It is renewed meanwhile. What this object changes is changed under the lease, also after
        it was lost: a `ProblemError` of type ``/problems/lease-lost`` says so then.

        Parameters
        ----------
        holder
            What to tell others who controls the camera.
        duration_s
            How long the lease lasts if this process dies.
        on_lapse
            Whether the capture, and with it the light, stops then.
        takeover
            Take it from whoever has it.
        """
        terms = {
            "holder": holder,
            "duration_s": duration_s,
            "on_lapse": on_lapse,
            "takeover": takeover,
        }
        return Lease(self._ask, self._show_lease, terms)

    def safe_off(self) -> dict[str, Any]:
        """Switch the light off, whoever holds the lease."""
        return self._ask(rest.document("acquisition/safe-off", method="POST"))

    @property
    def frames(self) -> dict[str, Any]:
        """Which frames of the last seconds can be had, by their numbers."""
        return self._ask(rest.document("frames"))

    def timeline(self, recording: str) -> dict[str, Any]:
        """Return which frames a recording has, and when they were captured."""
        return self._ask(frame_requests.timeline(recording))

    def meta(
        self,
        *,
        number: int | None = None,
        recording: str | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> dict[str, Any]:
        """Return what is known of a frame; parameters as for `frame`."""
        return self._ask(frame_requests.meta(Which(number, recording, wait_s, after)))

    def latest(self, *, wait_s: float | None = None, after: int | None = None) -> dict[str, Any]:
        """Return what is known of the newest frame; ``wait_s`` and ``after`` as for `frame`."""
        return self.meta(wait_s=wait_s, after=after)

    def frame(
        self,
        product: str,
        *,
        number: int | None = None,
        recording: str | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
        time_s: object = None,
        bins: int | None = None,
        y: int | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> Frame:
        """Return one product of the newest frame, or of another one.

        Parameters
        ----------
        product
            Its name; `wire.PRODUCTS` lists them.
        number
            A former frame, as far as `frames` has it, or one that is still to come.
        recording
            Id of a recording instead, whose frames are counted from 1.
        region
            x, y, width and height of the part wanted, in pixels.
        decimation
            Every so many pixels of it, both ways.
        time_s
            For products over time: the times of flight to evaluate at, in s.
        bins
            For the same, instead: how many times, evenly over the unambiguous time.
        y
            For ``streak``: its row.
        wait_s
            How long to wait for a frame, if there is none yet, or none after ``after``.
        after
            Number of a frame; only a newer one will do.
        """
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return self._ask(frame_requests.frame(product, which, part))

    def file(
        self,
        product: str,
        form: str,
        *,
        colour: bool = False,
        number: int | None = None,
        recording: str | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
        time_s: object = None,
        bins: int | None = None,
        y: int | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> bytes:
        """Return one product of a frame as a file; parameters as for `frame`.

        ``form`` is ``"png"``, ``"npy"``, ``"npz"``, ``"tiff"``, ``"ply"`` or ``"csv"``; not every
        product fits every one. ``colour`` makes a PNG for the eye.
        """
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return self._ask(frame_requests.file(product, form, which, part, colour=colour))

    def picture(
        self,
        product: str,
        *,
        colour: bool = False,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> bytes:
        """Return one product of the newest frame as PNG: 16 bit (range in mm), or for the eye."""
        return self.file(product, "png", colour=colour, wait_s=wait_s, after=after)

    def pixel(
        self,
        *,
        x: int,
        y: int,
        bins: int | None = None,
        number: int | None = None,
        recording: str | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> dict[str, Any]:
        """Return everything about one pixel of a frame; parameters as for `frame`."""
        which = Which(number, recording, wait_s, after)
        return self._ask(frame_requests.pixel(which, x=x, y=y, bins=bins))

    @property
    def simulation(self) -> dict[str, Any]:
        """The simulated world; a problem where the camera is real."""
        return self._ask(rest.document("simulation"))

    def simulate(
        self, scene: str | None = None, *, effects: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Put a simulated camera before a built-in scene; capturing goes on meanwhile.

        ``effects`` takes the place of all earlier choices: "auto", "on" or "off" by name.
        """
        return self._ask(rest.simulation(scene, effects))

    def cause(self, fault: str) -> dict[str, Any]:
        """Let something go wrong in the simulation: unplug, replug, corrupt-image, drop-image."""
        return self._ask(rest.fault(fault))

    def record(
        self,
        *,
        name: str | None = None,
        duration_s: float | None = None,
        frames: int | None = None,
        history_s: float | None = None,
        annotations: Mapping[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Let the daemon record raw frames, until a limit or `stop_recording`; describe it.

        With ``history_s`` it begins with the frames of the last seconds: what just happened.
        """
        return self._ask(
            rest.record(
                name=name,
                duration_s=duration_s,
                frames=frames,
                history_s=history_s,
                annotations=annotations,
            )
        )

    def recordings(self) -> dict[str, Any]:
        """Return all recordings of the daemon, the newest first."""
        return self._ask(rest.document("recordings"))

    def recording(self, recording_id: str) -> dict[str, Any]:
        """Describe a recording."""
        return self._ask(rest.recording(recording_id))

    def stop_recording(self, recording_id: str) -> dict[str, Any]:
        """End a recording, wait until it is on the disk, and describe it."""
        stop = rest.recording(recording_id, method="POST", part="/stop", patience_s=60.0)
        return self._ask(stop)

    def download_recording(
        self, recording_id: str, output: Path, *, progress: Progress | None = None
    ) -> None:
        """Fetch a recording's file; until it is whole it is called ``<output>.part``.

        ``progress`` is called with the bytes that came and with how many there are, if that is
        known.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        part = output.with_name(output.name + ".part")
        url = f"{self._address.api}/{rest.recording_file(recording_id)}"
        with translated(self.url), self._http.stream("GET", url) as response:
            if response.status_code != httpx.codes.OK:
                response.read()
                raise rest.problem(answer(response))
            told = Told(response, progress)
            with part.open("wb") as file:
                for piece in response.iter_bytes():
                    told.wrote(file.write(piece))
        part.rename(output)

    def stream(
        self,
        *products: str | Subscription,
        on_notice: NoticeHandler | None = None,
        reconnect: bool | Reconnect = False,
        credits: int | None = DEFAULT_CREDITS,  # noqa: A002 - the protocol calls them so
        max_rate_hz: float | None = None,
        start: int | None = None,
    ) -> Stream:
        """Return a stream of frames as they are captured.

        Each product of a frame comes as a frame of its own, in the order of the products.

        Parameters
        ----------
        products
            Names, or `Subscription` where each has its own rate, region, decimation or encoding;
            frames arrive decoded.
        on_notice
            Called with each notice, within ``receive``; `Stream.notices` keeps them too.
        reconnect
            Come back by itself when the daemon restarts or the network fails; tells so by the
            notices ``connection-lost`` and ``reconnected``.
        credits
            How many frames may be on their way at once; None leaves it to the network.
        max_rate_hz
            No more frames a second than this.
        start
            Number of the first frame wanted; None for the next one. Those that are kept still come
            one after the other, and the notice ``gap`` says which are not.

        Raises
        ------
        ParameterError
            If there is no product, or a number is out of range.
        """
        subscribe = subscribe_message(
            products, token=self._token, credits=credits, max_rate_hz=max_rate_hz, start=start
        )
        state = StreamState(subscribe, on_notice=on_notice, reconnect=reconnect_policy(reconnect))
        stream = Stream(self._address.stream, state, timeout_s=self._timeout_s)
        self._streams = [*(each for each in self._streams if not each.closed), stream]
        return stream

    def close(self) -> None:
        """Close every connection and stream; the daemon goes on."""
        for stream in self._streams:
            stream.close()
        self._http.close()

    def __enter__(self) -> "Camera":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Camera {self.url}>"

    def _show_lease(self, lease_id: str | None) -> None:
        if lease_id is None:
            self._http.headers.pop(LEASE_HEADER, None)
        else:
            self._http.headers[LEASE_HEADER] = lease_id

    def _ask(self, request: rest.Request[_T]) -> _T:
        with translated(self.url):
            response = self._http.request(
                request.method,
                f"{self._address.api}/{request.path}",
                **request_options(request, timeout_s=self._timeout_s),
            )
        return request.result(answer(response))
