"""The table of products: what a frame can be asked for, and what travels of it."""

import tomllib
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
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


_TABLE: Final = tomllib.loads(Path(__file__).with_name("products.toml").read_text("utf-8"))
PRODUCTS: Final = {
    name: Product(name, **stated | {"axes": tuple(stated["axes"])})
    for name, stated in _TABLE.items()
}
