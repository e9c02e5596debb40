"""Photon transfer: the noise of a sensor over its signal, from static frames (EMVA 1288)."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Camera, RawFrame, Sequence, capture_calibration
from transientcam_moments.noise import ROUNDING_VARIANCE
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import Recipe, factory_gains
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
EXPOSURES: Final = 8
LONGEST_S: Final = 0.05
_FIRST_S: Final = 5e-4
_SPAN: Final = 128.0
"""Of the exposures; the longest one fills a tenth of the pixels twice."""
_GROUPS: Final = 8
"""Points of one exposure: as many pixels each, from the darkest to the brightest."""
_CLIPPED: Final = 0.01
"""Share of a group's values that may lie at an end of the converter."""
_STILL, _SAME = 1.5, 5.0
"""Squares of differences over the usual ones: of images out of step, and of pixels that move."""
_BENT: Final = 0.7
"""Variance over that of the line, below which a pixel is full."""
_LEAST_POINTS: Final = 8
_MOST_UNCERTAIN: Final = 0.1


@dataclass(frozen=True, slots=True)
class PhotonTransfer:
    """A sensor, and the points that it was fitted to.

    Attributes
    ----------
    sensor
        Of the straight line through them.
    gain_uncertainty
        Standard error of the gain, over it.
    saturates
        Whether pixels were full; else the end of the converter stands for that.
    points
        (2, K) mean of images above the dark level in DN, and variance of one image in DN^2.
    """

    sensor: tm.noise.Sensor
    gain_uncertainty: float
    saturates: bool
    points: _Array

    @classmethod
    def of(
        cls, points: _Array, dark_dn: float, bits: int, full_dn: float | None = None
    ) -> "PhotonTransfer":
        """Fit points; full pixels scatter less than the line, or are known to hold so much.

        Raises
        ------
        Problem
            ``invalid-request`` where they do not tell the gain to 10 %.
        """
        signal, variance = points = points[:, np.argsort(points[0])]
        used = signal <= signal.max(initial=0.0) / 2
        for _ in range(3):
            if np.count_nonzero(used) < _LEAST_POINTS:
                raise _untold(f"{np.count_nonzero(used)} points are between dark and full")
            growth, dark, error = _line(signal[used], variance[used])
            used = variance >= _BENT * (dark + growth * signal)
        if not error <= _MOST_UNCERTAIN * growth:
            raise _untold("the noise hardly grows with the light")
        full = signal[~used & (signal > signal[used].max() / 2)]
        if full.size:
            full_dn = float(np.median(full))
        saturation_dn = (1 << bits) - 1 - dark_dn if full_dn is None else full_dn
        gain, read_dn = 1 / growth, math.sqrt(max(dark - ROUNDING_VARIANCE, 0.0))
        sensor = tm.noise.Sensor(gain, gain * saturation_dn, gain * read_dn, dark_dn, bits)
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


def measure_photon_transfer(
    camera: Camera, *, frames: int, go_on: Callable[[float], None] = lambda share: None
) -> PhotonTransfer:
    """Measure the noise of a camera before a scene that stands still, at rising exposures.

    Differences of successive images tell it, so that neither pixels nor slow drift add to it;
    images out of step and pixels that move are left out. Of a camera whose images are differences
    the signal is half of b_0, since their mean is no light.

    Parameters
    ----------
    camera
        Idle; has the sequence of before afterwards.
    frames
        Of each exposure.
    go_on
        Called several times a second with the share that is done; what it raises ends this.

    Raises
    ------
    Problem
        ``invalid-request`` where its frames do not tell the gain.
    CameraError
        As the camera does.
    """
    before, about = camera.applied.sequence, camera.capabilities
    highest_dn = (1 << about.bits) - 1
    zeroth = "on-off" if "on-off" in about.zeroths else about.zeroths[0]
    base = about.nearest(Sequence(harmonics=1, zeroth=zeroth, exposure_s=_FIRST_S))
    exposures_s, levels_dn, found = _exposures(camera, base, highest_dn), [], []
    try:
        for done, exposure_s in enumerate(exposures_s):
            camera.configure(replace(base, exposure_s=exposure_s))
            *planes, level_dn = _captured(
                camera,
                frames,
                lambda part, of, done=done: go_on((done + part / of) / len(exposures_s)),
            )
            levels_dn.append(level_dn)
            found.append(planes)
    finally:
        camera.configure(before)
    dark_dn = about.dark_dn
    if dark_dn is None:  # where no light is left, exposed for no time
        low = np.array(levels_dn) <= max(highest_dn / 2, min(levels_dn))
        line = np.polyfit(
            np.array(exposures_s)[low], np.array(levels_dn)[low], min(1, low.sum() - 1)
        )
        dark_dn = max(float(line[-1]), 0.0)
        found = [[signal - dark_dn, *rest] for signal, *rest in found]
    points = [_points(*planes) for planes in found]
    whole = [k for k, each in enumerate(points) if each.shape[1] == _GROUPS]
    full_dn = None
    if len(whole) > 1:  # where more light gives no more signal, and no value is clipped
        before_s, last_s = (exposures_s[k] for k in whole[-2:])
        before_dn, last_dn = (float(points[k][0].max()) for k in whole[-2:])
        full_dn = last_dn if last_dn < _BENT * before_dn * last_s / before_s else None
    return PhotonTransfer.of(np.concatenate(points, axis=1), dark_dn, about.bits, full_dn)


def _captured(
    camera: Camera, frames: int, go_on: Callable[[int, int], None]
) -> tuple[_Array, _Array, _Array, float]:
    """Return signal, variance and share of clipped values of pixels, and the level without light.

    The signal begins at the level, but of images that are differences.
    """
    about, applied, found = camera.capabilities, camera.applied, []
    highest_dn = (1 << about.bits) - 1

    def average(takes: NDArray[np.uint16]) -> tuple[_Array, NDArray[np.bool_]]:
        images = takes[:, 0].astype(np.float32)
        squares = np.diff(images, axis=0) ** 2
        usual = squares.mean(axis=(1, 2))
        kept = usual <= _STILL * np.median(usual)
        mean, ends = images.mean(axis=0), (images <= 0) | (images >= highest_dn)
        found.append((mean, squares[kept].mean(axis=0) / 2, ends.mean(axis=0)))
        return mean[None], np.ones((len(takes), 1), dtype=bool)

    capture = capture_calibration(camera, takes=frames, average=average, progress=go_on)
    mean, variance, clipped = (np.stack(each) for each in zip(*found, strict=True))
    level_dn = float(np.median(mean if capture.dark is None else capture.dark))
    if about.dark_dn is None:
        return mean, variance, clipped, level_dn
    gains = factory_gains(camera.factory)
    recipe = Recipe(applied, ReconstructionSettings(), float(highest_dn), gains)
    images = np.rint(mean).astype(np.uint16)
    measured = recipe.reconstruct(
        RawFrame(0, 0, images, applied.labels, 0.0, 0.0, 0.0, 0.0, 0)
    ).measured
    half = np.abs(measured[-len(applied.sequence.multiples)]) / 2
    return half, variance.mean(axis=0), clipped.max(axis=0), level_dn


def _points(signal: _Array, variance: _Array, clipped: _Array) -> _Array:
    """Return signal and variance (2, K) of groups of pixels alike, none of them clipped."""
    signal, variance, clipped = (each.ravel() for each in (signal, variance, clipped))
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


def _exposures(camera: Camera, base: Sequence, highest_dn: int) -> list[float]:
    """Return rising exposures: at the longest one the brighter pixels are full, if they can be."""
    about, exposure_s = camera.capabilities, base.exposure_s
    while True:
        camera.configure(replace(base, exposure_s=exposure_s))
        bright, dark = np.quantile(capture_calibration(camera, takes=2).images, (0.9, 0.01))
        if bright < highest_dn or exposure_s <= about.min_exposure_s:
            break
        exposure_s = max(exposure_s / 8, about.min_exposure_s)
    fills_s = 2 * exposure_s * highest_dn / max(bright - dark, 1.0)
    longest_s = max(min(fills_s, LONGEST_S, about.max_exposure_s), about.min_exposure_s)
    series = np.geomspace(max(longest_s / _SPAN, about.min_exposure_s), longest_s, EXPOSURES)
    return sorted({about.exposure_grid_s(float(each)) for each in series})


def _line(signal: _Array, variance: _Array) -> tuple[float, float, float]:
    """Return growth, beginning and standard error of the growth; errors are shares of it."""
    weight = 1 / np.maximum(variance, ROUNDING_VARIANCE)
    for _ in range(3):
        (growth, dark), covariance = np.polyfit(signal, variance, 1, w=weight, cov=True)
        growth, dark = max(float(growth), 1e-9), max(float(dark), 0.0)
        weight = 1 / np.maximum(dark + growth * signal, ROUNDING_VARIANCE)
    return growth, dark, math.sqrt(covariance[0, 0])


def _untold(why: str) -> Problem:
    detail = f"These frames do not tell the noise of the sensor: {why}."
    limit = "a still scene of dark and bright parts"
    return Problem(kinds.INVALID_REQUEST, detail, field="scene", value=None, limit=limit)
