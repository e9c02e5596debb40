"""Text from elsewhere, as it may be shown."""

import math
import unicodedata

import pytest
from hypothesis import given, strategies as st

from transientcam.text import figures, plain


@pytest.mark.parametrize(
    "text", ["Kamera 3, 20 °C — «é» 光", "", "brackets [bold] stay", "emoji 🙂", " a  b "]
)
def test_what_can_be_seen_stays(text: str) -> None:
    assert plain(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", "\\x1b]0;title\\x07"),
        ("\x1b]52;c;eA==\x1b\\", "\\x1b]52;c;eA==\\x1b\\"),
        ("\x1b[2J\x9b31m", "\\x1b[2J\\x9b31m"),
        ("a\rb\x08\x7f", "a\\rb\\x08\\x7f"),
        ("txt.\u202eexe\u2066\u200b", "txt.\\u202eexe\\u2066\\u200b"),
        ("a\u2028b\x85c", "a\\u2028b\\x85c"),
        ("\ud800", "\\ud800"),
        ("\U000e0041", "\\U000e0041"),
        ("one\ntwo\t", "one\\ntwo\\t"),
    ],
)
def test_what_a_terminal_obeys_is_written_out(text: str, shown: str) -> None:
    assert plain(text) == shown


def test_ends_of_lines_stay_where_they_are_meant() -> None:
    assert plain("one\n\ttwo\r\x1b", lines=True) == "one\n\ttwo\\r\\x1b"


@given(st.text())
def test_no_control_and_no_turn_is_left_whatever_came(text: str) -> None:
    shown = plain(text)
    turns = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
    assert not any(ord(each) < 0x20 or 0x7F <= ord(each) < 0xA0 for each in shown)
    assert not any(unicodedata.bidirectional(each) in turns for each in shown)
    shown.encode()  # it can be written


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (120.4, 2, "120"),
        (1234.5, 3, "1230"),
        (0.012345, 3, "0.0123"),
        (10.0, 3, "10"),
        (-99.96, 3, "-100"),
        (5e9, 2, "5000000000"),
        (0.0, 3, "0"),
        (math.inf, 2, "inf"),
        (math.nan, 2, "nan"),
    ],
)
def test_figures_have_their_digits_and_no_exponent(value: float, digits: int, shown: str) -> None:
    assert figures(value, digits) == shown
