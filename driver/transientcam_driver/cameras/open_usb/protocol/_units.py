"""Physical quantities as the integers of the wire."""

import math


def nanoseconds(time_s: float) -> int:
    """Time in ns."""
    return round(time_s * 1e9)


def centidegrees(temperature_c: float) -> int:
    """Temperature in 1/100 degree Celsius, limited to int16."""
    return max(-32768, min(32767, round(temperature_c * 100)))


def phase_rad(word: int) -> float:
    """Phase of 1/65536 of a turn."""
    return word * 2 * math.pi / 65536


def phase_word(phase_rad: float) -> int:
    """Phase in 1/65536 of a turn."""
    return round(phase_rad / (2 * math.pi) * 65536) % 65536
