"""Planes of NumPy, JAX and CuPy: their precision, work in blocks, and how they are shown."""

from transientcam_moments.arrays._loops import repeat
from transientcam_moments.arrays._planes import (
    MAX_HARMONICS,
    Array,
    as_array,
    below_one,
    by_blocks,
    chosen,
    flat_planes,
    in_range,
    in_turn,
    moment_planes,
    namespace,
    phases,
    real_type,
    root_and_inverse,
    some,
    squared,
    to_complex,
)
from transientcam_moments.arrays._shown import map_html, summary

__all__ = [
    "MAX_HARMONICS",
    "Array",
    "as_array",
    "below_one",
    "by_blocks",
    "chosen",
    "flat_planes",
    "in_range",
    "in_turn",
    "map_html",
    "moment_planes",
    "namespace",
    "phases",
    "real_type",
    "repeat",
    "root_and_inverse",
    "some",
    "squared",
    "summary",
    "to_complex",
]
