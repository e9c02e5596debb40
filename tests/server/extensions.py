"""Entries for the registries of the wire contract, as both ends have them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam import wire

DIRECT_SHARE = wire.Product(
    "direct_share", "1", ("y", "x"), "<f4", "weight of the first return over all light"
)


def _encode(array: NDArray[Any]) -> wire.Coded:
    most = float(np.nanmax(array))
    codes = np.nan_to_num(255.0 * array / most).round().astype("|u1")
    return wire.Coded(codes, {"most": most})


def _decode(codes: NDArray[Any], document: Mapping[str, Any]) -> NDArray[np.float32]:
    return np.asarray(codes / 255.0 * document["most"], dtype=np.float32)


EIGHT_BITS = wire.Encoding(
    "u8",
    fits=lambda axes, dtype: axes == ("y", "x") and dtype == "<f4",
    encode=_encode,
    decode=_decode,
    fields={"most": {"type": "number"}},
    dtype="|u1",
)
