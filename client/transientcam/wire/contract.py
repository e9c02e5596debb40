"""Names, limits and the table of products, common to both ends."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

VERSION: Final = 1
SUBPROTOCOL: Final = "transientcam.v1.msgpack"
MEDIA_TYPE: Final = "application/vnd.msgpack"
MEDIA_TYPE_ALIASES: Final = ("application/msgpack", "application/x-msgpack")
PROBLEM_MEDIA_TYPE: Final = "application/problem+json"

LEASE_HEADER: Final = "Transientcam-Lease"
"""Names the lease that a request is made under."""

MAX_CLIENT_MESSAGE_BYTES: Final = 64 * 1024
"""The server reads no message longer than this."""
MAX_SERVER_MESSAGE_BYTES: Final = 512 * 1024 * 1024
"""The client reads no message longer than this: 640 x 480 at 32 harmonics is 80 MB."""
MAX_SUBSCRIPTIONS: Final = 16
F32: Final = "f32"
"""Unchanged values, whatever their dtype."""
U16: Final = "u16"
"""Images of float in steps: ``offset + scale * code``."""
REFLECTION16: Final = "reflection16"
"""Coefficients as reflection coefficients of 16 bits a part; approximate."""
ENCODINGS: Final = (F32, U16, REFLECTION16)
MAX_CREDITS: Final = 64
MAX_DECIMATION: Final = 64
"""At most every 64th pixel is sent, both ways."""
FIRST_MESSAGE_WITHIN_S: Final = 10.0


_IMAGE = ("y", "x")


class CloseCode(IntEnum):
    """Why a stream ended; below 4000 as in RFC 6455."""

    NORMAL = 1000
    GOING_AWAY = 1001
    """The server shuts down."""
    ABNORMAL = 1006
    """The connection broke; never sent."""
    POLICY = 1008
    """The origin of the page is not allowed."""
    TOO_BIG = 1009
    INTERNAL_ERROR = 1011
    TRY_AGAIN_LATER = 1013
    """Too many clients, or too many messages wait for this one."""
    BAD_FIRST_MESSAGE = 4001
    """The first message was missing, late, or no valid ``subscribe``."""
    AUTHENTICATION_FAILED = 4003
    TOO_MANY_MESSAGES = 4008
    """The client sent more messages a second than the server reads."""


@dataclass(frozen=True, slots=True)
class Product:
    """One kind of array that a frame offers.

    Attributes
    ----------
    unit
        Of the values: ``m``, ``DN`` (digital numbers of the sensor), ``DN/s`` or ``1``.
    axes
        Names of the axes, slowest first.
    dtype
        As numpy writes it, byte order included.
    """

    name: str
    unit: str
    axes: tuple[str, ...]
    dtype: str
    summary: str

    @property
    def encodings(self) -> tuple[str, ...]:
        """Names of the encodings that it can be sent in."""
        if self.axes == _IMAGE and self.dtype == "<f4":
            return F32, U16
        return (F32, REFLECTION16) if self.name == "coefficients" else (F32,)


PRODUCTS: Final[dict[str, Product]] = {
    product.name: product
    for product in (
        Product("range", "m", _IMAGE, "<f4", "range of the first return; NaN without one"),
        Product("direct", "DN", _IMAGE, "<f4", "weight of the first return"),
        Product("indirect", "DN", _IMAGE, "<f4", "weight of all later returns"),
        Product("uniform", "DN", _IMAGE, "<f4", "weight spread evenly over all times"),
        Product("brightness", "DN", _IMAGE, "<f4", "zeroth moment: all light"),
        Product("validity", "1", _IMAGE, "<f4", "smallest eigenvalue of the moments, over b_0"),
        Product("flags", "1", _IMAGE, "|u1", "what was wrong with a pixel; 0 for nothing"),
        Product(
            "coefficients",
            "DN,1",
            ("coefficient", *_IMAGE),
            "<f4",
            "E in DN, then Re and Im of a_1 to a_m (Eq. 2; a_0 is 1)",
        ),
        Product("moments", "DN", ("moment", *_IMAGE), "<c8", "calibrated moments b_0 to b_m"),
        Product("raw", "DN", ("image", *_IMAGE), "<u2", "images of the sensor, each labelled"),
        Product("transient", "DN/s", ("time", *_IMAGE), "<f4", "density over time of flight"),
        Product("cumulative", "DN", ("time", *_IMAGE), "<f4", "light up to a time of flight"),
        Product("streak", "DN/s", ("time", "x"), "<f4", "density over time of flight of one row"),
        Product(
            "bounds",
            "DN/s",
            ("bound", "time", *_IMAGE),
            "<f4",
            "least and greatest density, smoothed, that the moments allow",
        ),
        Product(
            "returns",
            "s,DN",
            ("return", *_IMAGE),
            "<f4",
            "time of flight and weight of each return, the strongest first; NaN and 0 for none",
        ),
        Product(
            "pointcloud",
            "m",
            ("coordinate", *_IMAGE),
            "<f4",
            "x (right), y (down), z (forward) of the first return; NaN without one",
        ),
        Product("truth", "m", _IMAGE, "<f4", "the simulated scene's range; NaN without light"),
    )
}
"""Every product by name."""
