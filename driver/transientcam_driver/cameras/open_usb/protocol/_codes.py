"""Choices of a sequence, in the order of their codes on the wire (usb-protocol 5.1)."""

from transientcam_driver.sequence import Scheme, TakeOrder, Zeroth

ZEROTHS: tuple[Zeroth, ...] = ("on-off", "low-frequency", "estimated")
SCHEMES: tuple[Scheme, ...] = ("none", "arccos", "harmonic-cancellation")
TAKE_ORDERS: tuple[TakeOrder, ...] = ("sequential", "interleaved")
