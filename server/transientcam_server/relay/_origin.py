"""The service that is relayed: what its REST interface says, and errors as those of a camera."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

import transientcam
import transientcam_moments as tm
from transientcam.lease import Lease
from transientcam.stream import Stream
from transientcam.stream_state import NoticeHandler
from transientcam_driver import CalibrationError, CameraError, CameraLost, Capabilities
from transientcam_server.errors import OriginRefused
from transientcam_server.imaging import FACTORY_ID, NOMINAL_ID, Calibration, load_calibration
from transientcam_server.relay._frames import RAW, SUBSCRIBED
from transientcam_server.settings import CorruptImages

_CAPABILITIES: Final = TypeAdapter(Capabilities)
_CORRUPT_IMAGES: Final[TypeAdapter[CorruptImages]] = TypeAdapter(CorruptImages)
_SENSOR: Final = TypeAdapter(tm.noise.Sensor)
_CREDITS: Final = 2
"""One frame travels while another is taken: more would only make frames older."""


@dataclass(frozen=True, slots=True)
class Described:
    """An origin at one moment.

    Attributes
    ----------
    service_id, path
        Of the origin, and of all services from there to the camera, itself first.
    version
        Of its software.
    role
        What this relay may do there.
    capabilities, sensor, intrinsics
        Of its camera.
    sequence
        That is captured: the document of ``GET /sequence``.
    calibration
        That is active there; None for nominal gains.
    spoilt_images
        What becomes there of images that lost their synchronisation.
    """

    service_id: str
    path: tuple[str, ...]
    version: str
    role: str
    capabilities: Capabilities
    sensor: tm.noise.Sensor
    intrinsics: Mapping[str, Any]
    sequence: Mapping[str, Any]
    calibration: Calibration | None
    spoilt_images: CorruptImages


class Origin:
    """A connection to another service; methods may be called from any thread.

    Every method raises `CameraLost` where it does not answer as it should, and those that change
    something `OriginRefused` where it refuses.

    Parameters
    ----------
    url
        Its address.
    token
        What authenticates this relay there; None where none is required.
    timeout_s
        For a connection, and for each answer.
    product
        What is relayed: a key of `SUBSCRIBED`.

    Attributes
    ----------
    product
        As given.
    """

    def __init__(
        self, url: str, token: str | None, *, timeout_s: float, product: str = RAW
    ) -> None:
        self.product = product
        self._client = transientcam.Camera(url, token=token, timeout_s=timeout_s)
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
                    capabilities=_capabilities(camera["capabilities"]),
                    sensor=_SENSOR.validate_python(camera["sensor"]),
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

    def set_running(self, running: bool) -> None:
        """Start or stop the capture."""
        with self._changing():
            _ = self._client.start() if running else self._client.stop()

    def safe_off(self) -> None:
        """Switch the light off, whichever client holds the lease."""
        with self._changing():
            self._client.safe_off()

    def take_lease(self, holder: str, **terms: Any) -> None:
        """Take the lease on these terms, in the place of one that this relay has; it is renewed."""
        self.release_lease()
        lease = self._client.lease(holder, **terms)
        with self._changing():
            lease.__enter__()
        self._lease = lease

    def release_lease(self) -> None:
        """Give the lease back, if there is one; where that fails it lapses."""
        lease, self._lease = self._lease, None
        if lease is not None:
            with suppress(transientcam.TransientcamError):
                lease.__exit__(None, None, None)

    def close(self) -> None:
        """Close every connection; the origin goes on."""
        self.release_lease()
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


def _capabilities(document: Mapping[str, Any]) -> Capabilities:
    """Return what can be done through a relay: phases cannot be shifted over REST."""
    return replace(_CAPABILITIES.validate_python(document), phase_offsets=False)


def require_same_camera(known: Capabilities, now: Capabilities) -> None:
    """Refuse an origin that has another camera than before.

    Raises
    ------
    CameraError
        Naming both.
    """
    if now != known:
        before, after = f"{known.model} {known.serial}", f"{now.model} {now.serial}"
        raise CameraError(
            f"the origin had the camera {before} and has {after}, or what it can do has changed: "
            "start this relay anew"
        )
