"""The table of products: what a frame can be asked for, and what travels of it."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from transientcam.wire._contract import F32
from transientcam.wire._encodings import ENCODINGS


@dataclass(frozen=True, slots=True)
class Product:
    """One kind of array that a frame offers."""

    name: str
    unit: str
    """Of the values: ``m``, ``DN`` (digital numbers of the sensor), ``DN/s`` or ``1``."""
    axes: tuple[str, ...]
    """Names of the axes, slowest first."""
    dtype: str
    """As numpy writes it, byte order included."""
    summary: str

    @property
    def encodings(self) -> tuple[str, ...]:
        """Names of the encodings that it can be sent in."""
        fitting = (each.name for each in ENCODINGS.values() if each.fits(self.axes, self.dtype))
        return F32, *fitting


class Trust(IntEnum):
    """Why not to trust a pixel's range, the first reason of several: see `TrustCounts`."""

    TRUSTED = 0
    NO_RANGE = 1
    CORRUPT_IMAGE = 2
    MOTION = 3
    NO_DIRECT_LIGHT = 4
    SHADOW = 5
    EDGE = 6
    LATER_LIGHT_UNRESOLVED = 7
    LATER_LIGHT = 8
    DRIFT = 9
    NOISE = 10


_TABLE: Final = """\
range | m | y,x | <f4 | range of the first return; NaN without one
direct | DN | y,x | <f4 | weight of the first return
indirect | DN | y,x | <f4 | weight of all later returns
uniform | DN | y,x | <f4 | weight spread evenly over all times
brightness | DN | y,x | <f4 | zeroth moment: all light
validity | 1 | y,x | <f4 | smallest eigenvalue of the moments, over b_0
range_std | m | y,x | <f4 | standard deviation that the noise of the sensor gives the range; NaN \
without one
range_bias | m | y,x | <f4 | bias of the range, as far as the frame shows it; NaN if m = 1
range_error | m | y,x | <f4 | half width of the 90 % interval of this pixel's range; NaN if m = 1
trust | 1 | y,x | |u1 | why not to trust a range; 0 where it is trusted
reduced_chi_square | 1 | y,x | <f4 | misfit over noise, about 1 where the moments are explained: \
of two-returns or unwrapped-phase where that is the estimator, of the likelihood else
frames_averaged | 1 | y,x | <u2 | how many frames a pixel is the mean of
flags | 1 | y,x | |u1 | what was wrong with a pixel; 0 for nothing
coefficients | DN,1 | coefficient,y,x | <f4 | E in DN, then Re and Im of a_1 to a_m (Eq. 2; a_0 \
is 1)
moments | DN | moment,y,x | <c8 | calibrated moments b_0 to b_m
measured_moments | DN | moment,y,x | <c8 | calibrated moments b_0 to b_m before smoothing and \
biasing
raw | DN | image,y,x | <u2 | images of the sensor, each labelled
transient | DN/s | time,y,x | <f4 | density over time of flight
density_std | DN/s | time,y,x | <f4 | standard deviation of transient that the sensor's noise \
predicts, to first order
cumulative | DN | time,y,x | <f4 | light up to a time of flight
streak | DN/s | time,x | <f4 | density over time of flight of one row
bounds | DN/s | bound,time,y,x | <f4 | least and greatest density, smoothed, that the moments allow
returns | s,DN | return,y,x | <f4 | time of flight and weight of each return, the strongest \
first; NaN and 0 for none
pointcloud | m | coordinate,y,x | <f4 | x (right), y (down), z (forward) of the first return; NaN \
without one
truth | m | y,x | <f4 | range of the simulated surface, lit or not
direct_share | 1 | y,x | <f4 | share of light straight from the lamp
"""
"""A line a product: name, unit, axes, type, what it is."""


def _product(line: str) -> Product:
    name, unit, axes, dtype, summary = line.split(" | ")
    return Product(name, unit, tuple(axes.split(",")), dtype, summary)


PRODUCTS: Final = {product.name: product for product in map(_product, _TABLE.splitlines())}
"""Every product by name: an entry here and one of the server's registry make a product."""
