"""From raw images to calibrated and smoothed moments (Sec. 3.1, 4.2, 4.3 and 6)."""

from typing import Any

from numba import njit

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import ComplexPlanes, Flags, Images, RealPlane, RealPlanes
from transientcam_moments._kernels.portable import larger, select, some
from transientcam_moments.arrays import Length, Plane
from transientcam_moments.images import phasors

LOW_FREQUENCY, ON_OFF, ESTIMATED = 0, 1, 2
_ROWS = 8  # that are smoothed before they leave the caches


@njit(forceinline=True, error_model="numpy")
def _bucket(one: Plane, images: Images, first: int, p: int) -> Any:
    """Return the phasor of four images, and the largest of them."""
    i0, i90 = simd.load(one, images[first], p), simd.load(one, images[first + 1], p)
    i180, i270 = simd.load(one, images[first + 2], p), simd.load(one, images[first + 3], p)
    return phasors.bucket(i0, i90, i180, i270)


@njit(nogil=True, error_model="numpy")
def measure(
    order: Length,
    images: Images,
    zeroth: int,
    inverse: ComplexPlanes,
    stride: int,
    full_scale: float,
    moments: ComplexPlanes,
    flags: Flags,
    start: int,
    stop: int,
) -> None:
    """Write calibrated moments and the flag 4 of saturated pixels for the pixels start..stop.

    ``inverse`` holds what to multiply with, (m + 1, n): a row of lanes for all pixels alike
    (``stride`` 0) or one number a pixel (``stride`` 1).
    """
    one = simd.ones(moments, 1)
    step = simd.width(one)
    limit = simd.spread(one, full_scale)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        first = 4
        x, largest = one * 0.0, one * 0.0
        if zeroth == LOW_FREQUENCY:
            x, y, largest = _bucket(one, images, 0, p)
            x = phasors.low_frequency(x, y)
        elif zeroth == ON_OFF:
            on, off = simd.load(one, images[0], p), simd.load(one, images[1], p)
            x, largest = phasors.on_off(on, off)
            first = 2
        else:
            first = 0
        u, v = simd.load_complex(one, inverse[0], p * stride)
        simd.store_complex(moments[0], p, x * u, x * v)
        for j in range(1, len(order) + 1):
            x, y, here = _bucket(one, images, first + 4 * (j - 1), p)
            largest = larger(largest, here)
            u, v = simd.load_complex(one, inverse[j], p * stride)
            x, y = phasors.calibrated(x, y, u, v)
            simd.store_complex(moments[j], p, x, y)
        simd.store(flags, p, select(largest >= limit, 4.0 * one, 0.0))


@njit(nogil=True, error_model="numpy")
def smooth(
    moments: RealPlanes,
    taps: RealPlane,
    weight: RealPlane,
    rows: RealPlane,
    out: RealPlanes,
    width: int,
    start: int,
    stop: int,
) -> bool:
    """Smooth rows start..stop of all planes (n, H * 2 W), real and imaginary parts interleaved.

    ``weight`` (H * 2 W) normalises, ``rows`` (2 W + 4 R + lanes) is room for a row with 2 R zeros
    before and behind it. Returns whether every moment is finite; where one isn't, neither is what
    is near it.
    """
    one = simd.ones(weight, 4)  # a tap is spread once for four registers
    step = simd.width(one)
    radius = taps.shape[0] // 2
    length = 2 * width
    height = weight.shape[0] // length
    margin = 2 * radius
    poison = one * 0.0
    for j in range(moments.shape[0]):
        plane, smoothed = moments[j], out[j]
        for y in range(start, stop):
            low, high = max(-radius, -y), min(radius, height - 1 - y)
            for left in range(0, length, step):
                x = min(left, length - step)
                total = one * 0.0
                for k in range(low, high + 1):
                    total = total + taps[radius + k] * simd.load(one, plane, (y + k) * length + x)
                simd.store(rows, margin + x, total)
                poison = poison + total * 0.0
            for left in range(0, length, step):
                x = min(left, length - step)
                total = one * 0.0
                for k in range(2 * radius + 1):
                    total = total + taps[k] * simd.load(one, rows, x + 2 * k)
                p = y * length + x
                simd.store(smoothed, p, total * simd.load(one, weight, p))
    return not some(~(poison >= 0.0))


@njit(nogil=True, error_model="numpy")
def measure_and_smooth(
    order: Length, images: Images, zeroth: int, inverse: ComplexPlanes, stride: int, full_scale:
    float, moments: ComplexPlanes, flags: Flags, taps: RealPlane, weight: RealPlane, rows:
    RealPlane, planes: RealPlanes, out: RealPlanes, width: int, start: int, stop: int,
) -> None:  # fmt: skip
    """Write the smoothed moments of rows, each few of them as soon as they are measured.

    ``moments`` (m + 1, H W) are what `measure` writes and ``planes`` the same memory, as `smooth`
    reads it. The rows beside start..stop are measured, too: threads whose parts lie beside each
    other write the same there.
    """
    radius = taps.shape[0] // 2
    height = weight.shape[0] // (2 * width)
    measured = max(0, start - radius)
    for top in range(start, stop, _ROWS):
        bottom = min(stop, top + _ROWS)
        needed = min(height, bottom + radius)
        measure(
            order, images, zeroth, inverse, stride, full_scale, moments, flags, measured * width,
            needed * width,
        )  # fmt: skip
        smooth(planes, taps, weight, rows, out, width, top, bottom)
        measured = needed
