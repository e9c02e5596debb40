"""Why a range is not to be trusted: the codes of the product `trust`."""

from enum import IntEnum


class Trust(IntEnum):
    """Why the range of a pixel is not to be trusted; 0 where it is.

    Of several reasons a pixel has the first. The fields of `TrustCounts` count them by these names,
    and say what each means.
    """

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
