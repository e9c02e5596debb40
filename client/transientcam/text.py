"""Text from elsewhere, made fit to be shown."""

import unicodedata
from typing import Final

_UNSEEN: Final = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Controls, formats (bidirectional ones among them), lone surrogates, ends of lines."""


def plain(text: str, *, lines: bool = False) -> str:
    """Return text in which nothing moves a cursor, writes a title or a clipboard, or turns words.

    What has no sign of its own is written as Python escapes it. With ``lines`` ends of lines and
    tabs stay.
    """
    if text.isprintable():
        return text
    kept = "\n\t" if lines else ""
    return "".join(
        each
        if each in kept or unicodedata.category(each) not in _UNSEEN
        else each.encode("unicode_escape").decode()
        for each in text
    )


def figures(value: float, digits: int) -> str:
    """Return a number with so many significant digits, and never with an exponent."""
    return f"{float(f'{value:.{digits}g}'):.15g}" if abs(value) < 1e15 else f"{value:g}"
