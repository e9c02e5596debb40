"""What a camera that runs by itself measures: raw exposures, complex moments, and its frames."""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import (
    Extrinsics,
    Lens,
    Sensor,
    require,
    require_image,
    require_stated,
)


@dataclass(frozen=True, slots=True)
class Exposure:
    """A raw image of each frame: gain (offset + 1/2 (b_0 + Re(b exp(-i phase)))), in DN.

    ``frequency_hz``, ``phase_rad``: of the modulation. Each frequency needs three phases or more;
    repeated ones are averaged.
    ``exposure_s``: where it differs, moments are those of the first frequency's exposure.
    ``gain``, ``offset_dn``: of the tap that saw it, or (H, W) of its pixels.
    """

    frequency_hz: float
    phase_rad: float
    exposure_s: float = 1e-3
    gain: float | NDArray[Any] = 1.0
    offset_dn: float | NDArray[Any] = 0.0


@dataclass(frozen=True, slots=True)
class Moment:
    """A complex image of each frame, amplitude * exp(i phase); NaN where a pixel has none.

    ``std``: standard deviation of its real and of its imaginary part, in its own unit; or (H, W).
    ``largest``: what its modulus may reach; larger ones count as saturated.
    ``gain``: complex, or (H, W): what it is divided by, so that it is sum a exp(2 pi i f tau).
    """

    frequency_hz: float
    std: float | NDArray[Any]
    largest: float
    gain: complex | NDArray[Any] = 1.0


Measurement = Exposure | Moment


@dataclass(frozen=True, slots=True)
class Capture:
    """One frame of a device.

    ``images``: (H, W) each, of the measurements of its description and in their order: digital
    numbers of exposures, complex numbers of moments.
    ``number``: the device's frame counter: a gap says how many frames were lost.
    ``device_time_s``: begin of the first exposure, on the clock of the device.
    ``temperature_c``: of the sensor; None where it is not known.
    ``capture_s``: from then to the last read-out; a period of the frame rate by default.
    """

    images: Sequence[NDArray[Any]]
    number: int
    device_time_s: float
    temperature_c: float | None = None
    capture_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse a number that is not whole (TypeError); one of NumPy would overflow."""
        object.__setattr__(self, "number", operator.index(self.number))


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """What a free-running device is and measures.

    ``frame_rate_hz``: of whole frames, as the device states it.
    ``measurements``: what each frame holds, in the order of the images of a `Capture`.
    ``bits``: of raw exposures: a pixel of the highest code is saturated.
    ``sensor``: whose noise exposures have, in the DN that ``gain`` and ``offset_dn`` of an
    `Exposure` leave; None where that is not known.
    ``max_range_m``: needed where frequencies have no base whose multiples are 32 or less.
    ``min_exposure_s``, ``max_exposure_s``: where the exposure can be set.
    ``extrinsics``: where the sensor is mounted, where the device knows.
    ``clock``, ``heartbeat_s``: as of `Capabilities`.
    """

    model: str
    serial: str
    firmware: str
    width: int
    height: int
    frame_rate_hz: float
    measurements: tuple[Measurement, ...]
    bits: int = 12
    sensor: Sensor | None = None
    max_range_m: float | None = None
    lens: Lens | None = None
    extrinsics: Extrinsics | None = None
    clock: Literal["device", "ptp"] = "device"
    heartbeat_s: float = 0.0
    min_exposure_s: float | None = None
    max_exposure_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be measured (ProtocolError)."""
        require_stated(self)
        require_image(self.width, self.height, self.bits)
        require("measurements", len(self.measurements), "at least one", self.measurements)
        require("frame_rate_hz", self.frame_rate_hz > 0, "above 0 Hz", self.frame_rate_hz)
        for at, each in enumerate(self.measurements):
            name, f_hz = f"measurements[{at}]", each.frequency_hz
            require(f"{name}.frequency_hz", 0 < f_hz < math.inf, "above 0 Hz", f_hz)
            planes = {"gain": each.gain}
            if isinstance(each, Moment):
                planes["std"] = each.std
                inside = np.all((np.asarray(each.std) > 0) & (np.asarray(each.std) < each.largest))
                require(f"{name}.std", inside, f"above 0, below {each.largest}", each.std)
            else:
                planes["offset_dn"] = each.offset_dn
            for part, value in planes.items():
                shape = np.shape(value)
                require(f"{name}.{part}", shape in ((), self.size), f"one or {self.size}", shape)
            usable = np.all(np.isfinite(each.gain) & (np.asarray(each.gain) != 0))
            require(f"{name}.gain", usable, "finite and not 0", each.gain)

    @property
    def size(self) -> tuple[int, int]:
        """Height and width in pixels."""
        return self.height, self.width
