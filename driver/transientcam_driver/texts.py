"""Texts that users write, whichever program saved them."""

import codecs
from pathlib import Path
from typing import Final

_OTHERS: Final = (
    (codecs.BOM_UTF32_LE, "UTF-32"),  # begins as that of UTF-16 does
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, with or without a byte order mark, any line ends as LF.

    Raises OSError if it cannot be read.
    Raises ValueError if it is in another encoding: a clause that says which, and what to do.
    """
    data = path.read_bytes()
    for mark, name in _OTHERS:
        if data.startswith(mark):
            raise ValueError(f"is {name}; save it as UTF-8")
    if b"\0" in data:
        raise ValueError("is UTF-16, or no text; save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found = f"byte 0x{data[error.start]:02x} in line {line}"
        raise ValueError(f"is not UTF-8 ({found}); save it as UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def in_celsius(temperature_c: float | None) -> str:
    """Return a temperature in words."""
    return "no temperature known" if temperature_c is None else f"{temperature_c:.1f} °C"
