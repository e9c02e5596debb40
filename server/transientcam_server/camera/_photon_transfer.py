"""Photon transfer: the noise of a sensor over its signal, from static frames (EMVA 1288)."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Camera, Capabilities, Sequence, capture_calibration
from transientcam_moments.noise import ROUNDING_VARIANCE, Sensor
from transientcam_server.errors import Problem, kinds

_Array = NDArray[Any]
EXPOSURES_S: Final = tuple(5e-5 * 2**k for k in range(10))
_GROUPS: Final = 8
"""Points of one exposure: as many pixels each, from the darkest to the brightest."""
_CLIPPED: Final = 0.01
"""Share of a group's values that may lie at an end of the converter."""
_STILL, _SAME = 1.5, 10.0
"""Squares of differences over the usual ones: of images out of step, and of pixels that move."""
_BENT: Final = 0.7
"""Variance, and signal, over that of a straight line, below which a pixel is full."""
_LEAST_POINTS, _MOST_UNCERTAIN = 8, 0.1


@dataclass(frozen=True, slots=True)
class PhotonTransfer:
    """A sensor, and the points (2, K) it was fitted to: signal in DN, variance of images in DN^2.

    ``gain_uncertainty`` is the standard error over the gain; ``saturates`` says whether pixels were
    full: else the end of the converter stands for that.
    """

    sensor: Sensor
    gain_uncertainty: float
    saturates: bool
    points: _Array

    @classmethod
    def of(
        cls, points: _Array, dark_dn: float, bits: int, full_dn: float | None = None
    ) -> "PhotonTransfer":
        """Fit points; full pixels scatter less than the line, and hold so much, if they were seen.

        Raises Problem ``invalid-request`` where they do not tell the gain to 10 %.
        """
        signal, variance = points = points[:, np.argsort(points[0])]
        growth, dark, error, used = 0.0, 0.0, 0.0, signal <= signal.max(initial=0.0) / 2
        for _ in range(3):
            if np.count_nonzero(used) < _LEAST_POINTS:
                raise _untold(f"{np.count_nonzero(used)} points are between dark and full")
            growth, dark, error = _line(signal[used], variance[used])
            used = variance >= _BENT * (dark + growth * signal)
        if not error <= _MOST_UNCERTAIN * growth:
            raise _untold("the noise hardly grows with the light")
        holds_dn = (1 << bits) - 1 - dark_dn if full_dn is None else full_dn
        gain, read_dn = 1 / growth, math.sqrt(max(dark - ROUNDING_VARIANCE, 0.0))
        sensor = Sensor(gain, gain * holds_dn, gain * read_dn, dark_dn, bits)
        return cls(sensor, error / growth, full_dn is not None, points)

    def to_document(self) -> dict[str, Any]:
        """Return it as JSON, with the figures that EMVA 1288 (release 4) states."""
        sensor = self.sensor
        full_e, gain = sensor.full_well_e, sensor.gain_e_per_dn
        dark_e = math.hypot(sensor.read_noise_e, gain * math.sqrt(ROUNDING_VARIANCE))
        return {
            "sensor": asdict(sensor),
            "emva1288": {
                "system_gain_dn_per_e": 1 / gain,
                "system_gain_uncertainty": self.gain_uncertainty,
                "temporal_dark_noise_e": dark_e,
                "dark_level_dn": sensor.dark_dn,
                "saturation_capacity_e": full_e,
                "saturation_seen": self.saturates,
                "snr_max_db": 10 * math.log10(full_e),
                "dynamic_range_db": 20 * math.log10(full_e / (dark_e + 0.5)),
            },
            "signal_dn": self.points[0].tolist(),
            "variance_dn2": self.points[1].tolist(),
        }


def measure_photon_transfer(camera: Camera, *, frames: int) -> PhotonTransfer:
    """Measure the noise of a camera before a scene that stands still, at rising exposures.

    Differences of successive images tell it, so that neither pixels nor slow drift add to it;
    images out of step and pixels that move are left out. Images that are differences of two taps
    show their light by its modulation at the lowest frequency: before a scene without other light
    they tell a sensor of one tap that has their noise. The camera is idle, and has its sequence of
    before afterwards. ``frames`` are those of each exposure.

    Raises Problem: ``invalid-request`` where its frames do not tell the gain.
    """
    before, about = camera.applied.sequence, camera.capabilities
    zeroth = "on-off" if "on-off" in about.zeroths else about.zeroths[0]
    base_hz = Sequence().base_frequency_hz if about.dark_dn is None else about.min_frequency_hz
    any_s = (Sequence(base_hz, 1, zeroth, exposure_s=each_s) for each_s in EXPOSURES_S)
    base = dict.fromkeys(map(about.nearest, any_s))  # in rising order
    highest_dn, found, levels_dn, exposures_s = (1 << about.bits) - 1, [], [], list[float]()
    try:
        for sequence in base:
            exposures_s.append(camera.configure(sequence).sequence.exposure_s)
            *planes, level_dn = _captured(camera, frames, highest_dn)
            if about.dark_dn is not None:
                planes, level_dn = _of_modulation(planes, about), about.dark_dn
            levels_dn.append(level_dn)
            found.append(planes)
    finally:
        camera.configure(before)
    low = np.array(levels_dn) <= max(highest_dn / 2, min(levels_dn))
    degree = 1 if low.sum() > 1 else 0
    # where no light is left, exposed for no time
    line = np.polyfit(np.array(exposures_s)[low], np.array(levels_dn)[low], degree)
    dark_dn = max(float(line[-1]), 0.0)
    points = [_points(mean - dark_dn, *others) for mean, *others in found]
    tops = [
        (each_s, float(each[0].max()))
        for each_s, each in zip(exposures_s, points, strict=True)
        if each.shape[1] == _GROUPS  # none is clipped
    ]
    (before_s, before_dn), (last_s, last_dn) = tops[-2:] if len(tops) > 1 else [(1.0, 0.0)] * 2
    # more light gives no more signal
    full_dn = last_dn if last_dn < _BENT * before_dn * last_s / before_s else None
    return PhotonTransfer.of(np.concatenate(points, axis=1), dark_dn, about.bits, full_dn)


def _captured(camera: Camera, frames: int, highest_dn: int) -> tuple[_Array, _Array, _Array, float]:
    """Return mean, variance and share of clipped values (N, H, W), and the level without light."""
    found = []

    def average(takes: NDArray[np.uint16]) -> tuple[_Array, NDArray[np.bool_]]:
        images = takes[:, 0].astype(np.float32)
        squares = np.diff(images, axis=0) ** 2
        usual = squares.mean(axis=(1, 2))
        kept = usual <= _STILL * np.median(usual)
        mean, ends = images.mean(axis=0), (images <= 0) | (images >= highest_dn)
        found.append((mean, squares[kept].mean(axis=0) / 2, ends.mean(axis=0)))
        return mean[None], np.ones((len(takes), 1), dtype=bool)

    capture = capture_calibration(camera, takes=frames, average=average)
    mean, variance, clipped = (np.stack(each) for each in zip(*found, strict=True))
    return mean, variance, clipped, float(np.median(mean if capture.dark is None else capture.dark))


def _of_modulation(planes: list[_Array], about: Capabilities) -> list[_Array]:
    """Return half of the light (1, H, W) on the dark level, and the others of all N phases."""
    mean, variance, clipped = planes
    turned = np.exp(1j * np.array(about.sampling.phases_rad))[:, None, None]
    signal = 2 * np.abs((mean[: len(turned)] * turned).mean(axis=0)) + (about.dark_dn or 0.0)
    return [each[None] for each in (signal, variance.mean(axis=0), clipped.max(axis=0))]


def _points(*planes: _Array) -> _Array:
    """Return signal and variance (2, K) of groups of pixels alike, none of them clipped."""
    signal, variance, clipped = (each.ravel() for each in planes)
    found = []
    for group in np.array_split(np.argsort(signal), _GROUPS):
        if clipped[group].mean() <= _CLIPPED:
            values = variance[group]
            most = np.quantile(values, 0.9)
            for _ in range(3):
                most = max(values[values <= most].mean(), ROUNDING_VARIANCE) * _SAME
            kept = values <= most
            found.append((signal[group][kept].mean(), values[kept].mean()))
    return np.array(found).reshape((-1, 2)).T


def _line(signal: _Array, variance: _Array) -> tuple[float, float, float]:
    """Return growth, beginning and standard error of the growth; errors are shares of it."""
    growth, dark, covariance = 0.0, 0.0, np.zeros((2, 2))
    weight = 1 / np.maximum(variance, ROUNDING_VARIANCE)
    for _ in range(3):
        (growth, dark), covariance = np.polyfit(signal, variance, 1, w=weight, cov=True)
        growth, dark = max(float(growth), 1e-9), max(float(dark), 0.0)
        weight = 1 / np.maximum(dark + growth * signal, ROUNDING_VARIANCE)
    return growth, dark, math.sqrt(covariance[0, 0])


def _untold(why: str) -> Problem:
    detail = f"These frames do not tell the noise of the sensor: {why}."
    return Problem(kinds.INVALID_REQUEST, detail, field="camera", value=None, limit=None)
