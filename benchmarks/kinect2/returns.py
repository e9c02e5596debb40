"""One and two returns by the estimators here, and by libfreenect2's on the same frames."""

from collections.abc import Iterator
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.tables import Table, verdict
from benchmarks.kinect2.decoding import NOISY_STD, ROUNDING, TOO_LONG
from tests.driver.cameras.kinect2 import libfreenect2
from tests.driver.cameras.kinect2.vectors import MULTIPLES, RADIAN_M, Array, Scene, load, noise
from transientcam_driver.cameras.kinect2 import (
    BASE_FREQUENCY_HZ,
    HEIGHT,
    SAMPLING,
    WIDTH,
    P0Tables,
    codes,
    encoder,
)
from transientcam_moments.comparisons._sra import sra

GROSS_M: Final = 0.05
RATIOS: Final = (0.1, 0.25, 0.5, 0.8)
APART_M: Final = (0.1, 0.3, 0.6, 1.2, 2.4)
_DRAWS: Final = 200
_AMPLITUDE: Final = 200.0
"""In counts; at more, libfreenect2 takes a smaller difference of phases for void."""
_SRA_BINS: Final = 1024
_SRA_BLOCKS: Final = 12
"""Of the blocks every so many are given to SRA, which takes 50 ms each."""


def tables() -> Iterator[Table]:
    """Compare on synthetic frames, and on returns through codes and back."""
    yield two_returns()
    yield separations()
    yield enough()
    yield one_return()


def one_return() -> Table:
    """Compare validity and gross errors on the scene with noise, steps and a dark patch."""
    scene = load("noisy")
    estimate = tm.unwrap(scene.moments, noise(NOISY_STD), harmonics=MULTIPLES)
    range_m = RADIAN_M * np.asarray(estimate.phase_rad)
    sure = np.asarray(estimate.explained() & ~estimate.ambiguous())
    sure &= ~scene.saturated.any(axis=0)
    theirs_mm = scene.stored["depth_mm_off"]
    true_mm = scene.z_mm(scene.path_m, "bottom")
    off_m = (scene.z_mm(2 * range_m, "bottom") - true_mm) / 1e3
    theirs_off_m = (theirs_mm / TOO_LONG - true_mm) / 1e3
    columns = ("of all pixels", "given", "gross errors", "RMS of the others")
    made = Table("One return with noise: `noisy`", columns)
    for name, off, given in (
        ("libfreenect2, filters off", theirs_off_m, theirs_mm > 0),
        ("`tm.unwrap`, where libfreenect2 gives a depth", off_m, theirs_mm > 0),
        ("`tm.unwrap`, neither ambiguous nor unexplained", off_m, sure),
    ):
        gross = ~(np.abs(off[given]) <= GROSS_M)  # also where there is no such point
        rms_m = np.sqrt(np.mean(off[given][~gross] ** 2))
        shares = f"{given.mean():.2%}", f"{gross.sum() / given.size:.3%}"
        made.rows.append((name, *shares, f"{1e3 * rms_m:.2f} mm"))
    return made


def two_returns() -> Table:
    """Compare on the scene with two returns: the share of all pixels within 5 and 1 cm."""
    scene = load("two_returns")
    moments = scene.of_blocks(scene.moments)
    true_m = scene.of_blocks(scene.path_m) / 2
    quiet = noise(ROUNDING)
    pair = tm.two_returns(moments, quiet, harmonics=MULTIPLES)
    single = tm.unwrap(moments, quiet, harmonics=MULTIPLES)
    rough = tm.likelihood(moments, quiet, harmonics=MULTIPLES, returns=2, tail_shape=0, threads=1)
    found = {
        "`tm.two_returns`": RADIAN_M * np.asarray(pair.separate().phase_rad),
        "`tm.likelihood`, two returns": RADIAN_M * np.asarray(rough.separate().phase_rad),
        "`tm.unwrap`, one return": RADIAN_M * np.asarray(single.phase_rad),
    }
    made = Table("Two returns: `two_returns`", ("of all pixels", "within 5 cm", "within 1 cm"))
    made.rows.append(_shares("libfreenect2, filters off", _theirs_off_m(scene)))
    some = np.s_[:: _SRA_BLOCKS // 4, ::4]
    light = sra(moments[(slice(None), *some)], harmonics=MULTIPLES, bins=_SRA_BINS)
    sparse = np.asarray(light.first_phase_rad()) * RADIAN_M - true_m[some]
    made.rows.append(_shares("SRA after Freedman et al. 2014", np.abs(sparse)))
    for name, range_m in found.items():
        made.rows.append(_shares(name, np.abs(range_m - true_m)))
    ours = np.abs(found["`tm.two_returns`"] - true_m)
    made.notes.append(verdict(100 * (ours < 0.05).mean(), 90, "per cent within 5 cm"))
    made.notes.append(verdict(100 * (ours < 0.01).mean(), 60, "per cent within 1 cm"))
    return made


def _theirs_off_m(scene: Scene) -> Array:
    """Return the error of libfreenect2's depth; infinite where it gives none."""
    depth_mm = scene.stored["depth_mm_off"]
    off_mm = np.abs(depth_mm / TOO_LONG - scene.z_mm(scene.path_m, "bottom"))
    return np.where(depth_mm > 0, off_mm / 1e3, np.inf)


def _shares(name: str, off_m: Array) -> tuple[str, str, str]:
    return name, f"{(off_m < 0.05).mean():.1%}", f"{(off_m < 0.01).mean():.1%}"


def separations() -> Table:
    """Show the error of the first return by separation and ratio, through codes and back."""
    columns = ("second over first", *(f"{each:g} m" for each in APART_M))
    made = Table("Median error of the first return, libfreenect2's in brackets", columns)
    rng = np.random.default_rng(9)
    shape = len(RATIOS), len(APART_M), _DRAWS
    first_m = rng.uniform(1.0, 5.0, shape)
    second_m = first_m + np.array(APART_M)[:, None]
    ratio = np.array(RATIOS)[:, None, None]
    waves = [_waves(each) for each in (first_m, second_m)]
    moments = _through_codes(_AMPLITUDE * (waves[0] + ratio * waves[1]))
    found = tm.two_returns(moments, noise(ROUNDING), harmonics=MULTIPLES)
    off_mm = 1e3 * np.abs(RADIAN_M * np.asarray(found.separate().phase_rad) - first_m)
    path_m = libfreenect2.path_m(moments)
    theirs_mm = 1e3 * np.where(path_m > 0, path_m / TOO_LONG / 2 - first_m, np.inf)
    medians = np.median(off_mm, axis=2), np.median(theirs_mm, axis=2)
    for ours, theirs, each in zip(*medians, RATIOS, strict=True):
        texts = (
            f"{mine:.1f} mm ({f'{their:+.0f} mm' if np.isfinite(their) else 'void'})"
            for mine, their in zip(ours, theirs, strict=True)
        )
        made.rows.append((f"{each:g}", *texts))
    return made


def enough() -> Table:
    """Show how often one return is taken for two, and two for one, by the noise."""
    columns = ("noise of a sample", "one taken for two", *(f"two, {each:g} m" for each in APART_M))
    made = Table("Which number of returns is found", columns)
    rng = np.random.default_rng(10)
    for std in (0.5, 2.0, 5.0):
        apart = np.array((0.0, *APART_M))
        first_m = rng.uniform(1.0, 5.0, (len(apart), 5 * _DRAWS))
        second = 0.5 * _waves(first_m + apart[:, None]) * (apart[:, None] > 0)
        clean = _AMPLITUDE * (_waves(first_m) + second)
        moments = _through_codes(clean, std=std, rng=rng)
        total = noise(float(np.hypot(std, 2 * ROUNDING)))
        found = tm.two_returns(moments, total, harmonics=MULTIPLES)
        share = (np.asarray(found.count) == 2).mean(axis=1)
        made.rows.append((f"{std:g} counts", *(f"{each:.1%}" for each in share)))
    return made


def _waves(range_m: Array) -> Array:
    """Return the moments (3, ...) of a return of weight 1."""
    turns = BASE_FREQUENCY_HZ * 2 * range_m / tm.SPEED_OF_LIGHT_M_S
    j = np.array(MULTIPLES).reshape((-1, *[1] * range_m.ndim))
    return np.asarray(np.exp(2j * np.pi * j * turns))


def _through_codes(
    moments: Array, *, std: float = 0.0, rng: np.random.Generator | None = None
) -> Array:
    """Return moments (3, ...) as a camera measures them, with noise of its samples, in counts."""
    tables = np.random.default_rng(11).integers(0, 65_536, (3, HEIGHT, WIDTH)).astype(np.uint16)
    gains = P0Tables(tables).gains()
    inside = np.zeros((3, HEIGHT, WIDTH - 2), complex)
    inside.reshape((3, -1))[:, : moments[0].size] = moments.reshape((3, -1))
    samples = encoder.samples(np.pad(inside, ((0, 0), (0, 0), (1, 1))), gains)
    if rng is not None:
        samples = samples + rng.normal(0, std, samples.shape)
    images = codes.frame_images(codes.sub_images(samples))
    measured = tm.measure(images, zeroth="estimated", phases_rad=SAMPLING.phases_rad)
    back = np.asarray(tm.calibrate(measured, gains))[1:, :, 1:-1].reshape((3, -1))
    return back[:, : moments[0].size].reshape(moments.shape)
