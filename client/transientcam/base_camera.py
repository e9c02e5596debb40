"""What `Camera` and `AsyncCamera` have in common: every request, stated once."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Final, Generic, TypeVar, overload

from transientcam.frame import Frame
from transientcam.lease import GIVE_BACK, BaseLease, OnLapse
from transientcam.requests import (
    Calibrations,
    Jobs,
    Part,
    Request,
    Which,
    document,
    frames,
    given,
    planning,
    recording_path,
)
from transientcam.stream import BaseStream
from transientcam.stream_state import (
    DEFAULT_CREDITS,
    NoticeHandler,
    Reconnect,
    StreamState,
    reconnect_policy,
    subscribe_message,
)
from transientcam.transport import parse_address
from transientcam.wire import Subscription

_SCENE_BUILT_S: Final = 60.0
"""The same of building a simulated scene."""
_WRITTEN_S: Final = 60.0
"""The same until all of a recording is on the disk."""
_Document = TypeVar("_Document")
_Frame = TypeVar("_Frame")
_Bytes = TypeVar("_Bytes")
_Lease = TypeVar("_Lease", bound=BaseLease)
_Stream = TypeVar("_Stream", bound=BaseStream)


class BaseCamera(ABC, Generic[_Document, _Frame, _Bytes, _Lease, _Stream]):
    """The requests of a camera; what they return is up to `_ask`.

    From a `Camera` that is a document, a `Frame` or bytes, from an `AsyncCamera` a coroutine of
    the same. A request that cannot be built raises `ParameterError` when its method is called.
    """

    def __init__(self, url: str, *, token: str | None, timeout_s: float) -> None:
        self._address = parse_address(url)
        self._token = token
        self._timeout_s = timeout_s
        self._streams: list[_Stream] = []

    @overload
    @abstractmethod
    def _ask(self, request: Request[dict[str, Any]]) -> _Document: ...
    @overload
    @abstractmethod
    def _ask(self, request: Request[Frame]) -> _Frame: ...
    @overload
    @abstractmethod
    def _ask(self, request: Request[bytes]) -> _Bytes: ...
    @abstractmethod
    def _ask(self, request: Request[Any]) -> Any:
        """Send a request, and return the result of its answer."""

    @abstractmethod
    def _leased(self, terms: dict[str, Any]) -> _Lease:
        """Return a lease on these terms."""

    @abstractmethod
    def _streaming(self, state: StreamState) -> _Stream:
        """Return the stream of a state."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.url}>"

    @property
    def url(self) -> str:
        """Address of the daemon, without a user's name and password."""
        return self._address.shown

    @property
    def has_token(self) -> bool:
        """Whether requests carry a token."""
        return self._token is not None

    def validate(self, settings: Mapping[str, Any]) -> _Document:
        """Return what a sequence would really be set to, without setting it."""
        return self._ask(document("sequence/validate", method="POST", body=settings))

    def plan(
        self,
        target: Mapping[str, float] | None = None,
        *,
        budget: Mapping[str, float] | None = None,
        fixed: Mapping[str, Any] | None = None,
        estimator: str | None = None,
        **more: Any,
    ) -> _Document:
        """Return the sequence and estimator for a target, or the best within a budget.

        Nothing is changed: ``sequence`` of the answer is what `configure` takes, and ``predicted``
        has noise, bias and the error that both make. It takes seconds; an abandoned call ends the
        work. ::

            camera.plan({"range_error_m": 0.005}, budget={"capture_s": 0.2})

        Parameters
        ----------
        target
            What has to be reached: ``range_error_m`` (noise and bias together), ``range_std_m``,
            ``separation_m``, ``bound_width``.
        budget
            What may be spent: ``capture_s``, ``frame_rate_hz``, ``computing_share``.
        fixed
            Fields of the sequence that must stay as given here.
        estimator
            The only one to plan with.
        more
            ``share`` of the pixels of a capture that are to be within ``range_error_m``, 0.9 if
            left out; ``region`` whose pixels count, ``[x, y, width, height]`` or corners.

        Raises
        ------
        ProblemError
            ``target-unreachable`` where nothing reaches the target; it says what limits.
        """
        return self._ask(
            planning.plan(target=target, budget=budget, fixed=fixed, estimator=estimator, **more)
        )

    def start_plan(
        self,
        target: Mapping[str, float] | None = None,
        *,
        budget: Mapping[str, float] | None = None,
        fixed: Mapping[str, Any] | None = None,
        estimator: str | None = None,
        **more: Any,
    ) -> _Document:
        """Begin what `plan` returns as a job, and return that; arguments as in `plan`.

        ::

            job = camera.start_plan({"range_error_m": 0.005})
            plan = camera.wait_for(job["id"], on_progress=print)["result"]

        With ``map`` the error of each pixel is predicted, too: `plan_map`.
        """
        return self._ask(
            planning.start_plan(
                target=target, budget=budget, fixed=fixed, estimator=estimator, **more
            )
        )

    def plan_map(self, job_id: str, form: str = "npy") -> _Bytes:
        """Return the predicted error of each pixel that the job of a plan made, as a file.

        ``numpy.load`` reads it, in m, NaN without light; the form ``png`` is for eyes.
        """
        return self._ask(planning.plan_map(job_id, form))

    def tradeoff(self, by: str = "range_error_m", *, estimator: str | None = None) -> _Document:
        """Return what accuracy costs in time: the sequences that no other beats, in ``front``."""
        return self._ask(planning.tradeoff(by=by, estimator=estimator))

    def start_tradeoff(self, by: str = "range_error_m", **more: Any) -> _Document:
        """Begin what `tradeoff` returns as a job; also for ``share``, ``region``, ``estimator``."""
        return self._ask(planning.start_tradeoff(by=by, **more))

    def start_series(
        self, settings: Sequence[Mapping[str, Any]], frames: int = 100, **more: Any
    ) -> _Document:
        """Begin to capture frames at each of the settings; returns the job, with ``rows``.

        ``more`` are ``target_m`` and a ``region``. ::

            job = camera.start_series([{"sequence": {"harmonics": m}} for m in (3, 4)])
            rows = camera.wait_for(job["id"])["result"]["rows"]
        """
        body = given(settings=[dict(each) for each in settings], frames=frames, **more)
        return self._ask(document("series/jobs", method="POST", body=body))

    def change_camera(self, camera: str) -> _Document:
        """Have the daemon open another camera, as ``"sim:corner"``, and serve that one instead.

        It begins anew within a second or two, with another ``service_id`` in `info`.
        """
        body, extra_s = {"camera": camera}, _SCENE_BUILT_S
        return self._ask(document("camera", method="PUT", body=body, extra_timeout_s=extra_s))

    @property
    def calibrations(self) -> Calibrations[_Document, _Bytes]:
        """The calibrations that the daemon keeps: to measure, use, export and import."""
        return Calibrations(self._ask, self._ask)

    @property
    def jobs(self) -> Jobs[_Document]:
        """Long-running jobs of the daemon: their progress and their end."""
        return Jobs(self._ask)

    def start(self, *, offs: int | None = None) -> _Document:
        """Start the capture; not where the acquisition's ``offs`` is another than this by now."""
        return self._ask(document("acquisition", method="PUT", body=given(running=True, offs=offs)))

    def stop(self) -> _Document:
        """Stop the capture."""
        return self._ask(document("acquisition", method="PUT", body={"running": False}))

    def safe_off(self) -> _Document:
        """Switch the light off, whichever client holds the lease."""
        return self._ask(document("acquisition/safe-off", method="POST"))

    def give_lease_back(self) -> _Document:
        """End the lease whose id the requests of this object carry."""
        return self._ask(GIVE_BACK)

    def lease(
        self,
        holder: str,
        *,
        duration_s: float = 30.0,
        on_lapse: OnLapse = "stop",
        takeover: bool = False,
    ) -> _Lease:
        """Return a context manager in which no other client can change anything.

        ::

            with camera.lease("alignment on bench 2"):
                camera.configure(harmonics=4)

        The lease is renewed meanwhile. Changes through this object carry it, also after it was
        lost: they then raise a `ProblemError` of type ``/problems/lease-lost``.

        Parameters
        ----------
        holder
            Name shown to other clients as the one that controls the camera.
        duration_s
            How long the lease lasts if this process dies.
        on_lapse
            Whether the capture, and with it the light, stops then.
        takeover
            Take the lease from its present holder.
        """
        terms = {"holder": holder, "duration_s": duration_s, "on_lapse": on_lapse}
        return self._leased(terms | {"takeover": takeover})

    def stream(
        self,
        *products: str | Subscription,
        on_notice: NoticeHandler | None = None,
        reconnect: bool | Reconnect = False,
        credits: int | None = DEFAULT_CREDITS,  # noqa: A002 - the protocol calls them so
        max_rate_hz: float | None = None,
        start: int | None = None,
    ) -> _Stream:
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
            Connect again when the daemon restarts or the network fails; the notices
            ``connection-lost`` and ``reconnected`` report it.
        credits
            How many frames may be on their way at once; None leaves it to the network.
        max_rate_hz
            Maximum frames per second.
        start
            Number of the first frame; None for the next one. Frames that the daemon still keeps
            come one after the other, and the notice ``gap`` names those that it does not.

        Raises
        ------
        ParameterError
            If there is no product, or a number is out of range.
        """
        subscribe = subscribe_message(
            products, token=self._token, credits=credits, max_rate_hz=max_rate_hz, start=start
        )
        state = StreamState(subscribe, on_notice=on_notice, reconnect=reconnect_policy(reconnect))
        stream = self._streaming(state)
        self._streams = [*(each for each in self._streams if not each.closed), stream]
        return stream

    def timeline(self, recording: str) -> _Document:
        """Return which frames a recording has, and when they were captured."""
        return self._ask(document(f"{recording_path(recording)}/frames"))

    def meta(
        self,
        *,
        number: int | None = None,
        recording: str | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> _Document:
        """Return the metadata of a frame; parameters as for `frame`."""
        return self._ask(frames.meta(Which(number, recording, wait_s, after)))

    def latest(self, *, wait_s: float | None = None, after: int | None = None) -> _Document:
        """Return the metadata of the newest frame; ``wait_s`` and ``after`` as for `frame`."""
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
    ) -> _Frame:
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
            x, y, width and height of the part to return, in pixels.
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
            Number of a frame; the one returned has to be newer.
        """
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return self._ask(frames.frame(product, which, part))

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
    ) -> _Bytes:
        """Return one product of a frame as a file; parameters as for `frame`.

        ``form`` is ``"png"``, ``"npy"``, ``"npz"``, ``"tiff"``, ``"ply"`` or ``"csv"``; not every
        product fits every one. ``colour`` makes a PNG in false colours.
        """
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return self._ask(frames.file(product, form, which, part, colour=colour))

    def picture(
        self,
        product: str,
        *,
        colour: bool = False,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> _Bytes:
        """Return one product of the newest frame as PNG: 16 bit (range in mm), or false colours."""
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
    ) -> _Document:
        """Return everything about one pixel of a frame; parameters as for `frame`."""
        which = Which(number, recording, wait_s, after)
        return self._ask(frames.pixel(which, x=x, y=y, bins=bins))

    def simulate(
        self,
        scene: str | None = None,
        *,
        definition: str | None = None,
        effects: Mapping[str, str] | None = None,
        diffuser: bool | None = None,
        diffusor: bool | None = None,
    ) -> _Document:
        """Put a simulated camera before another scene; capturing goes on meanwhile.

        ``scene`` names a built-in scene; ``definition`` is in its place the text of a scene file.
        ``effects`` replaces all earlier choices: "auto", "on" or "off" by name. ``diffuser`` puts
        filter and diffuser before the lens, to measure a calibration, or takes them away; it may
        also be called ``diffusor``.
        """
        before_lens = diffuser if diffusor is None else diffusor
        body = given(scene=scene, definition=definition, effects=effects, diffusor=before_lens)
        return self._ask(
            document("simulation", method="PUT", body=body, extra_timeout_s=_SCENE_BUILT_S)
        )

    def cause(self, fault: str) -> _Document:
        """Inject a fault into the simulation: unplug, replug, corrupt-image or drop-image."""
        return self._ask(document("simulation/faults", method="POST", body={"fault": fault}))

    def record(
        self,
        *,
        name: str | None = None,
        duration_s: float | None = None,
        frames: int | None = None,
        history_s: float | None = None,
        annotations: Mapping[str, Any] | None = None,
    ) -> _Document:
        """Record raw frames at the daemon, until a limit or `stop_recording`.

        With ``history_s`` the recording begins with the frames of the last seconds. Returns its
        description.
        """
        body = given(
            name=name,
            duration_s=duration_s,
            frames=frames,
            history_s=history_s,
            annotations=annotations,
        )
        return self._ask(document("recordings", method="POST", body=body))

    def recordings(
        self,
        *,
        search: str | None = None,
        tag: str | None = None,
        sort: str | None = None,
        offset: int | None = None,
        limit: int | None = None,
    ) -> _Document:
        """Return the newest 100 recordings, or those that match, and the totals of all of these.

        ``search`` has words, ``tag`` a tag, ``sort`` a field, downwards with a ``-`` before it;
        ``next_offset`` of the answer is the ``offset`` after a page of ``limit``, at most 1000.
        """
        asked = {"search": search, "tag": tag, "sort": sort, "offset": offset, "limit": limit}
        return self._ask(document("recordings", params=asked.items()))

    def recording(self, recording_id: str) -> _Document:
        """Return the description of a recording."""
        return self._ask(document(recording_path(recording_id)))

    def stop_recording(self, recording_id: str) -> _Document:
        """End a recording, wait until it is on the disk, and return its description."""
        path = f"{recording_path(recording_id)}/stop"
        return self._ask(document(path, method="POST", extra_timeout_s=_WRITTEN_S))
