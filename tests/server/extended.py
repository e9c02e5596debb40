"""A daemon with one more product, file format and stream encoding than there are.

Run as ``python -m tests.server.extended``: the entries are made before anything else is imported,
as if they stood in the registries. It prints its address and serves until its input ends.
"""

import sys

import numpy as np

from tests.server.extensions import DIRECT_SHARE, EIGHT_BITS
from transientcam import Frame, wire

wire.PRODUCTS[DIRECT_SHARE.name] = DIRECT_SHARE
wire.ENCODINGS[EIGHT_BITS.name] = EIGHT_BITS


def _register() -> None:
    from transientcam_server.imaging import PRODUCTS, Product
    from transientcam_server.imaging._encodings import ENCODINGS, Encoding

    def text(frame: Frame) -> bytes:
        return repr(np.round(frame.array, 3).tolist()).encode()

    PRODUCTS[DIRECT_SHARE.name] = Product(
        DIRECT_SHARE, "returns", lambda recipe, found, view: found.direct / found.brightness
    )
    ENCODINGS["txt"] = Encoding("txt", "text/plain", text)


def main() -> None:
    """Register, serve, and end with the input."""
    _register()
    from tests.serving import serving

    with serving("sim:wall?noise=off") as served:
        sys.stdout.write(f"{served.url}\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    main()
