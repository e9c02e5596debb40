"""Words of a sequence as the codes of the wire."""

from transientcam_driver.sequence import Scheme, TakeOrder, Zeroth

ZEROTHS: tuple[Zeroth, ...] = ("on-off", "low-frequency", "estimated")
SCHEMES: tuple[Scheme, ...] = ("none", "arccos", "harmonic-cancellation")
TAKE_ORDERS: tuple[TakeOrder, ...] = ("sequential", "interleaved")
