"""The service that is relayed: what its REST interface says, and errors as those of a camera."""

import ssl
import tempfile
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

import httpx
from pydantic import TypeAdapter, ValidationError

import transientcam
import transientcam_moments as tm
from transientcam.lease import Lease
from transientcam.stream import Stream
from transientcam.stream_state import NoticeHandler
from transientcam.wire import LEASE_HEADER
from transientcam_driver import CalibrationError, CameraError, CameraLost, Capabilities
from transientcam_server.errors import OriginRefused
from transientcam_server.imaging import FACTORY_ID, NOMINAL_ID, Calibration, load_calibration
from transientcam_server.relay._delivery import ATTEMPT_S
from transientcam_server.relay._frames import RAW, SUBSCRIBED
from transientcam_server.settings import CorruptImages, dataclass_of

_CORRUPT_IMAGES: Final[TypeAdapter[CorruptImages]] = TypeAdapter(CorruptImages)
_CREDITS: Final = 2
"""One frame travels while another is taken: more would only make frames older."""
_TRANSIENT: Final = (HTTPStatus.REQUEST_TIMEOUT, HTTPStatus.TOO_MANY_REQUESTS)
Change = Callable[[transientcam.AsyncCamera], Awaitable[object]]
"""What is to be done at the origin."""


@dataclass(frozen=True, slots=True)
class Described:
    """An origin at one moment."""

    service_id: str
    path: tuple[str, ...]
    """``service_id``, ``path``: of the origin, and of all services from there to the camera, itself
    first."""
    version: str
    """Of its software."""
    role: str
    """What this relay may do there."""
    capabilities: Capabilities
    sensor: tm.noise.Sensor | None
    intrinsics: Mapping[str, Any]
    """``capabilities``, ``sensor``, ``intrinsics``: of its camera."""
    sequence: Mapping[str, Any]
    """That is captured: the document of ``GET /sequence``."""
    calibration: Calibration | None
    """That is active there; None for nominal gains."""
    spoilt_images: CorruptImages
    """What becomes there of images that lost their synchronisation."""


class Origin:
    """A connection to another service; methods may be called from any thread.

    Every method raises `CameraLost` where it does not answer as it should, and those that change
    something `OriginRefused` where it refuses.

    ``url``: its address.
    ``token``: what authenticates this relay there; None where none is required.
    ``timeout_s``: for a connection, and for each answer.
    ``product``: what is relayed: a key of `SUBSCRIBED`.
    ``product``, ``timeout_s``: as given.
    """

    def __init__(
        self, url: str, token: str | None, *, timeout_s: float, product: str = RAW
    ) -> None:
        self.product = product
        self.timeout_s = timeout_s
        self._token = token
        self._client = transientcam.Camera(url, token=token, timeout_s=timeout_s)
        self._tls = httpx.create_ssl_context()
        self._lease: Lease | None = None

    @property
    def url(self) -> str:
        """Its address."""
        return self._client.url

    def describe(self) -> Described:
        """Return all that a relay has to know of it."""
        with self._answering():
            info, camera = self._client.info, self._client.camera
            try:
                described = Described(
                    service_id=str(info["service_id"]),
                    path=tuple(map(str, info["path"])),
                    version=str(info["version"]),
                    role=str(info["caller"]["role"]),
                    capabilities=replace(
                        dataclass_of(Capabilities, camera["capabilities"]),
                        phase_offsets=False,  # they cannot be shifted over REST
                    ),
                    sensor=camera["sensor"] and dataclass_of(tm.noise.Sensor, camera["sensor"]),
                    intrinsics=camera["intrinsics"],
                    sequence=self._client.sequence,
                    calibration=self._calibration(),
                    spoilt_images=_CORRUPT_IMAGES.validate_python(
                        info["reconstruction"]["spoilt_images"]
                    ),
                )
                self._require_products(info)
            except KeyError as error:
                reason = (
                    f"{self.url} runs transientcam {info.get('version', 'of an unknown version')}, "
                    f"which does not state {error}: it is too old to be relayed, update it"
                )
                raise CameraLost(reason) from error
            except ValidationError as error:
                first = error.errors()[0]
                place = ".".join(map(str, first["loc"]))
                raise CameraLost(f"{self.url} states {place} = {first['input']!r}") from error
            return described

    def camera(self) -> dict[str, Any]:
        """Return the document of its camera."""
        with self._answering():
            return self._client.camera

    def stream(self, *, start: int | None, on_notice: NoticeHandler) -> Stream:
        """Return a stream of what is relayed, from the frame ``start`` on where that is kept."""
        return self._client.stream(
            *SUBSCRIBED[self.product], credits=_CREDITS, start=start, on_notice=on_notice
        )

    def configure(self, sequence: Mapping[str, Any]) -> dict[str, Any]:
        """Set a sequence, and return it as it was really set."""
        with self._changing():
            return self._client.configure(**sequence)

    def offs(self) -> int | None:
        """Return how often its light was to go off; None of one that is too old to say so."""
        with self._answering():
            return self._client.acquisition.get("offs")

    def start(self, *, offs: int | None) -> None:
        """Start the capture, unless its light was to go off since there were so many ``offs``."""
        with self._changing():
            self._client.start(offs=offs)

    def stop(self) -> None:
        """Stop the capture."""
        with self._changing():
            self._client.stop()

    @property
    def lease_id(self) -> str | None:
        """The id of the lease that this relay has there."""
        return None if self._lease is None else self._lease.id

    async def send_apart(self, change: Change, *, lease_id: str | None = None) -> None:
        """Make a change over a connection of its own; what the origin may yet confirm is lost.

        Raises OriginRefused where it refuses for good: another try would be refused, too.
        """
        headers = {"prefer": f"wait={ATTEMPT_S:g}"}
        if lease_id is not None:
            headers[LEASE_HEADER] = lease_id
        camera = transientcam.AsyncCamera(
            self.url,
            token=self._token,
            timeout_s=ATTEMPT_S,
            transport=_WithHeaders(headers, verify=self._tls),
        )
        async with camera:
            try:
                await change(camera)
            except transientcam.ProblemError as error:
                if error.status in _TRANSIENT or error.status >= HTTPStatus.INTERNAL_SERVER_ERROR:
                    raise CameraLost(str(error)) from error
                raise OriginRefused(self.url, error.document) from error

    def take_lease(self, holder: str, **terms: Any) -> None:
        """Take the lease on these terms; it is renewed."""
        lease = self._client.lease(holder, **terms)
        with self._changing():
            lease.__enter__()
        self._lease = lease

    def abandon_lease(self) -> str | None:
        """Renew the lease no more, and return its id, if there is one."""
        lease, self._lease = self._lease, None
        if lease is None:
            return None
        lease.abandon()
        return lease.id

    def close(self) -> None:
        """Close every connection; the origin goes on."""
        if self._lease is not None:
            with suppress(transientcam.TransientcamError):
                self._lease.__exit__(None, None, None)
        self._client.close()

    def _require_products(self, info: Mapping[str, Any]) -> None:
        """Refuse an origin whose frames lack what is to be relayed."""
        there = {each["name"] for each in info["products"]}
        absent = {each["name"]: each["reason"] for each in info["absent_products"]}
        for name in SUBSCRIBED[self.product]:
            if name not in there:
                why = absent.get(name, "it is too old, update it")
                raise CameraLost(f"{self.url} has no {name}: {why}")

    def _calibration(self) -> Calibration | None:
        active = self._client.calibrations.active()
        if active["calibration_id"] == FACTORY_ID:
            reason = f"{self.url} calibrates by what its camera reports, which is not relayed yet"
            raise CameraLost(reason)
        if active["id"] == NOMINAL_ID:
            return None
        content = self._client.calibrations.export(active["id"])
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "calibration.npz"
            path.write_bytes(content)
            try:
                return load_calibration(path)
            except CalibrationError as error:
                raise CameraLost(f"{self.url} sent a calibration that is none: {error}") from error

    @contextmanager
    def _answering(self) -> Iterator[None]:
        try:
            yield
        except transientcam.TransientcamError as error:
            raise CameraLost(str(error)) from error

    @contextmanager
    def _changing(self) -> Iterator[None]:
        try:
            yield
        except transientcam.ProblemError as error:
            raise OriginRefused(self.url, error.document) from error
        except transientcam.TransientcamError as error:
            raise CameraLost(str(error)) from error


class _WithHeaders(httpx.AsyncHTTPTransport):
    """Sends some headers with every request."""

    def __init__(self, headers: Mapping[str, str], *, verify: ssl.SSLContext) -> None:
        super().__init__(verify=verify)
        self._headers = headers

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Send a request with them."""
        request.headers.update(self._headers)
        return await super().handle_async_request(request)


def require_same_camera(known: Capabilities, now: Capabilities) -> None:
    """Refuse an origin that has another camera than before. Raises CameraError naming both."""
    if now != known:
        before, after = f"{known.model} {known.serial}", f"{now.model} {now.serial}"
        raise CameraError(
            f"the origin had the camera {before} and has {after}, or what it can do has changed: "
            "start this relay anew"
        )
