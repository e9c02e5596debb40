"""What pixels of four images become: stated for a pixel, in the words of `arrays`."""

from transientcam_moments.arrays import Pair, Plane, larger, root


def bucket(i0: Plane, i90: Plane, i180: Plane, i270: Plane) -> tuple[Plane, Plane, Plane]:
    """Return (I_0 - I_180) + i (I_90 - I_270), and the largest of the four (Sec. 3.1)."""
    return i0 - i180, i90 - i270, larger(larger(i0, i90), larger(i180, i270))


def low_frequency(x: Plane, y: Plane) -> Plane:
    """Return b_0 of the phasor at a low frequency, its modulus (Sec. 4.3)."""
    return root(x * x + y * y)


def on_off(on: Plane, off: Plane) -> tuple[Plane, Plane]:
    """Return b_0 of images with and without light, and the larger of them."""
    return 2.0 * (on - off), larger(on, off)


def calibrated(x: Plane, y: Plane, u: Plane, v: Plane) -> Pair:
    """Return (x + i y) (u + i v): a moment divided by the gain whose reciprocal is given."""
    return x * u - y * v, x * v + y * u
