"""Tests whether a calibration was measured on a diffuser, or on a scene.

Through a diffuser every pixel sees one return at the same time (Sec. 4.2). Over the sensor the
phase of a frequency then is one number, up to a smooth field and a pattern that differs from pixel
to pixel; the phases of all frequencies belong to one time, and no moment is weakened by a second
return. All of it is tested on medians of blocks of pixels, which neither dirt nor single bad pixels
move, and to which a pattern of the pixels adds little. docs/measured/calibration-verdicts.md has
the figures that the limits rest on.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import CalibrationCapture
from transientcam_server.imaging._calibrations.verdict import Finding, Verdict, word_of
from transientcam_server.imaging._recipe.calibration import NOMINAL_ID, Calibration, nominal_gains

_Array = NDArray[Any]

LIMIT_SHARE: Final = 0.05
"""Share of the pixels that may be unlike a diffuser: damage, a corner outside the lens's circle."""
LIMIT_UNKNOWN: Final = 0.25
"""Share of the pixels that may be too dark, saturated, bad or too noisy to be judged."""
LIMIT_RESIDUAL_M: Final = 0.10
"""Of a block's range about the smooth field, besides noise."""
LIMIT_FIELD_M: Final = 1.0
"""Of the smooth field from end to end; one of 0.5 m was measured on the board of a product."""
LIMIT_OFFSET_M: Final = 0.10
"""Of the median range; 12 degrees of drift move it by less than 0.01 m."""
LIMIT_PHASE_RAD: Final = 0.3
"""Between a harmonic's phase and j times that of the first one, besides noise."""
LIMIT_MAGNITUDE: Final = 0.15
"""Of a harmonic's magnitude, in parts of its median over the sensor, besides noise."""
EXPLAINED_DEVIATIONS: Final = 4.0
"""Standard deviations of a block's median that noise and pattern explain."""
MOST_UNCERTAIN_M: Final = 0.3
"""A block whose range is known no better than this is not judged."""
SATURATED: Final = 0.98
"""Of the full scale, in any image."""
_BLOCKS: Final = 15  # along the shorter side of the sensor
_LEAST_BLOCK_PX: Final = 4
_LIT_SHARE: Final = 0.3  # of a block's pixels, for it to be judged
_DARK: Final = 0.1  # of the median brightness
_DEGREE: Final = 4  # of the polynomial that is the smooth field
_BLOCKS_PER_TERM: Final = 4
_STEPS: Final = 20  # of the robust fit
_BIWEIGHT: Final = 5.0  # robust standard deviations, from where on a block has no weight
_MAD: Final = 1.4826  # standard deviations in the median absolute deviation of normal variables
_MEDIAN_STD: Final = 1.2533  # standard deviation of a median over that of a mean


def judge(
    capture: CalibrationCapture,
    bad: _Array | None,
    *,
    full_scale: float | None = None,
    reference: Calibration | None = None,
) -> Verdict:
    """Judge whether a measurement was made on a diffuser.

    It is compared with an ideal camera, and if it does not look like a diffuser so, with the
    ``reference``: what the same camera measured before has its delay and its pattern.

    ``capture``: the measurement.
    ``bad`` (boolean array, shape (H, W), optional): pixels that are left out.
    ``full_scale``: largest value of an image in DN; saturated pixels are left out where it is
    known.
    ``reference``: a calibration of the same camera and sequence that is trusted.
    """
    usable = np.ones(capture.images.shape[1:], dtype=bool) if bad is None else ~bad
    if full_scale is not None:
        usable &= capture.images.max(axis=0) < SATURATED * full_scale
    verdict = _compared(capture, usable, nominal_gains(capture.sequence), None)
    if verdict.trusted or reference is None:
        return verdict
    known = _compared(capture, usable, reference.gains.planes, reference)
    return known if known.trusted else verdict


def _compared(
    capture: CalibrationCapture, usable: _Array, gains: _Array, reference: Calibration | None
) -> Verdict:
    sequence = capture.sequence
    measured = tm.measure(capture.images, zeroth=sequence.zeroth)
    with np.errstate(all="ignore"):
        moments = tm.calibrate(measured, gains)
        lit = _lit(moments, usable)
        light = _Light.of(moments, lit)
        metres = float(tm.range_m(np.float64(1.0), sequence.base_frequency_hz))
        rows, findings = _tests(light, metres)
        if sequence.zeroth == "low-frequency":
            findings = (*findings, _low_frequency(capture, lit, metres, reference))
    identity = NOMINAL_ID if reference is None else reference.gains.id
    return Verdict(word_of(findings), findings, light.block_px, rows, identity)


@dataclass(frozen=True, slots=True, eq=False)
class _Blocks:
    """Medians of blocks of a plane, NaN where too few pixels are lit, and their deviation."""

    median: _Array
    std: _Array

    def beyond_noise(self, expected: _Array | float = 0.0) -> _Array:
        """Return how far the medians are from what is expected, less what noise explains."""
        apart = np.abs(self.median - expected) - EXPLAINED_DEVIATIONS * self.std
        return np.asarray(np.maximum(apart, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class _Light:
    """The moments (m + 1, H, W) of lit pixels, to be looked at in blocks."""

    moments: _Array
    lit: _Array
    block_px: int

    @classmethod
    def of(cls, moments: _Array, lit: _Array) -> "_Light":
        return cls(moments, lit, max(_LEAST_BLOCK_PX, min(lit.shape) // _BLOCKS))

    def unit(self, j: int) -> _Array:
        """Return the phasor of a harmonic without its magnitude."""
        return np.asarray(self.moments[j] / np.abs(self.moments[j]))

    def angles(self, phasor: _Array) -> tuple[float, _Blocks]:
        """Return the mean angle of the pixels, and the angles of blocks about it."""
        centre = float(np.angle(np.nansum(phasor[self.lit]))) if self.lit.any() else np.nan
        return centre, self.blocks(np.angle(phasor * np.exp(-1j * centre)))

    def blocks(self, plane: _Array) -> _Blocks:
        inside = _cut(np.where(self.lit, plane, np.nan), self.block_px)
        count = np.isfinite(inside).sum(axis=-1)
        enough = count >= _LIT_SHARE * self.block_px**2
        median, std = np.full(count.shape, np.nan), np.full(count.shape, np.nan)
        if enough.any():
            chosen = inside[enough]
            median[enough] = np.nanmedian(chosen, axis=-1)
            spread = np.nanmedian(np.abs(chosen - median[enough][:, None]), axis=-1)
            std[enough] = _MEDIAN_STD * _MAD * spread / np.sqrt(count[enough])
        return _Blocks(median, std)


def _tests(light: _Light, metres: float) -> tuple[tuple[str, ...], tuple[Finding, ...]]:
    """Return the map of the blocks and the tests, all but that of the low frequency."""
    centre_rad, delay = light.angles(light.unit(1))
    known = EXPLAINED_DEVIATIONS * delay.std * metres <= MOST_UNCERTAIN_M  # not where it is NaN
    median = np.where(known, delay.median, np.nan)
    field = smooth_field(median)
    common_rad, phase = _harmonic_phases(light)
    residual_m = delay.beyond_noise(field) * metres
    magnitude = _magnitudes(light)
    unlike = known & (
        (residual_m > LIMIT_RESIDUAL_M) | (phase > LIMIT_PHASE_RAD) | (magnitude > LIMIT_MAGNITUDE)
    )
    if known.any():
        offset_m = (centre_rad + float(np.median(median[known]))) * metres
        half_m = np.pi * metres  # half of the unambiguous range
        offset_m = (offset_m + half_m) % (2 * half_m) - half_m
        field_m = float(np.ptp(field[known])) * metres
    else:
        offset_m = field_m = np.nan
    unlike_share = float(unlike[known].mean()) if known.any() else np.nan
    findings = (
        Finding("unknown_share", float(1 - known.mean()), LIMIT_UNKNOWN, "share"),
        Finding("unlike_share", unlike_share, LIMIT_SHARE, "share"),
        Finding("residual_m", _most(residual_m, known), LIMIT_RESIDUAL_M, "m"),
        Finding("harmonic_phase_rad", _most(phase, known), LIMIT_PHASE_RAD, "rad"),
        Finding("magnitude_share", _most(magnitude, known), LIMIT_MAGNITUDE, "share"),
        Finding("common_phase_rad", common_rad, LIMIT_PHASE_RAD, "rad"),
        Finding("field_m", field_m, LIMIT_FIELD_M, "m"),
        Finding("offset_m", offset_m, LIMIT_OFFSET_M, "m"),
    )
    characters = np.where(known, np.where(unlike, "#", "."), "?")
    return tuple("".join(row) for row in characters), findings


def _harmonic_phases(light: _Light) -> tuple[float, _Array]:
    """Return how far phases are from j times the first: of the whole sensor, and of each block."""
    first = light.unit(1)
    common_rad, worst = 0.0, np.zeros(_grid(light))
    for j in range(2, len(light.moments)):
        centre_rad, apart = light.angles(light.unit(j) / first**j)
        common_rad = float(np.maximum(common_rad, abs(centre_rad)))  # NaN stays
        worst = np.fmax(worst, apart.beyond_noise())
    return common_rad, worst


def _magnitudes(light: _Light) -> _Array:
    """Return how far each block's magnitudes are from those of the whole sensor."""
    worst = np.zeros(_grid(light))
    measured = bool(light.moments[0].any())
    whole = light.moments[0].real if measured else np.abs(light.moments[1])
    for j in range(1 if measured else 2, len(light.moments)):
        share = np.abs(light.moments[j]) / whole
        usual = np.median(share[light.lit]) if light.lit.any() else np.nan
        worst = np.fmax(worst, light.blocks(share / usual).beyond_noise(1.0))
    return worst


def _low_frequency(
    capture: CalibrationCapture, lit: _Array, metres: float, reference: Calibration | None
) -> Finding:
    """Compare the phase at the low frequency, which a wall at the unambiguous range cannot hide."""
    phasor = _low_phasor(capture)
    if reference is None:
        phasor = phasor / nominal_gains(capture.sequence)[1]
    else:
        phasor = phasor * np.conj(_low_phasor(reference.capture))
    rad = float(np.angle(np.nansum(phasor[lit]))) if lit.any() else np.nan
    low_m = float(tm.range_m(np.float64(rad), capture.low_frequency_hz))
    return Finding("low_frequency_m", low_m, np.pi * metres, "m")


def _low_phasor(capture: CalibrationCapture) -> _Array:
    first, second, third, fourth = capture.images[:4]
    return np.asarray((first - third) + 1j * (second - fourth))


def smooth_field(values: _Array) -> _Array:
    """Fit a polynomial over the sensor to (rows, columns), robustly; NaN are left out."""
    known = np.isfinite(values).ravel()
    degree = _degree(int(known.sum()))
    rows, columns = values.shape
    y, x = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    powers = [(i, k) for i in range(degree + 1) for k in range(degree + 1 - i)]
    terms = np.stack([x.ravel() ** i * y.ravel() ** k for i, k in powers], axis=1)
    if not known.any():
        return np.full(values.shape, np.nan)
    target, inside = values.ravel()[known], terms[known]
    weight = np.ones(len(target))
    found = np.zeros(len(powers))
    for _ in range(_STEPS):
        root = np.sqrt(weight)
        found = np.linalg.lstsq(inside * root[:, None], target * root, rcond=None)[0]
        residual = target - inside @ found
        scale = max(_MAD * float(np.median(np.abs(residual))), 1e-6)
        weight = np.clip(1 - (residual / (_BIWEIGHT * scale)) ** 2, 0.0, None) ** 2
    return np.asarray((terms @ found).reshape(values.shape))


def _degree(known: int) -> int:
    """Return that of the polynomial, less where few blocks are known."""
    fitting = [n for n in range(_DEGREE + 1) if _BLOCKS_PER_TERM * (n + 1) * (n + 2) // 2 <= known]
    return max(fitting, default=0)


def _lit(moments: _Array, usable: _Array) -> _Array:
    """Return the pixels that are usable and not dark."""
    brightness = moments[0].real if moments[0].any() else np.abs(moments[1])
    lit: _Array = usable & np.isfinite(moments).all(axis=0) & (np.abs(moments[1]) > 0)
    if not lit.any():
        return np.asarray(lit)
    return np.asarray(lit & (brightness > _DARK * np.median(brightness[lit])))


def _cut(plane: _Array, block_px: int) -> _Array:
    """Return the blocks of a plane (rows, columns, pixels), those at the edges filled with NaN."""
    rows, columns = (-(-length // block_px) for length in plane.shape)
    padded = np.full((rows * block_px, columns * block_px), np.nan)
    padded[: plane.shape[0], : plane.shape[1]] = plane
    cut = padded.reshape(rows, block_px, columns, block_px).swapaxes(1, 2)
    return cut.reshape(rows, columns, block_px**2)


def _grid(light: _Light) -> tuple[int, int]:
    rows, columns = (-(-length // light.block_px) for length in light.lit.shape)
    return rows, columns


def _most(values: _Array, known: _Array) -> float:
    """Return what all but as many blocks keep as may be unlike."""
    kept = np.nan_to_num(values[known])
    return float(np.quantile(kept, 1 - LIMIT_SHARE)) if kept.size else np.nan
