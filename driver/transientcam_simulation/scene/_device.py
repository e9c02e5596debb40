"""Read the table [device] of a scene file: a profile, and what of one unit differs from it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from transientcam_simulation.base import (
    PROFILES,
    DarkCurrent,
    DeviceProfile,
    Drift,
    LensScatter,
    Outliers,
    Pattern,
    Waveform,
)
from transientcam_simulation.scene._table import Table

MOST_E = 1e15
"""Electrons a second: with them and what the light falls on, no number is out of bounds."""
MOST_S = 1e-3
"""Of a delay."""


def read_device(table: Table, folder: Path | None) -> DeviceProfile:
    """Read the table of a device; ``folder`` is that of the scene's file."""
    profile = PROFILES[table.choice("profile", tuple(PROFILES), "ideal")]
    profile = replace(profile, seed=table.integer("seed", 0, least=0, most=2**63 - 1))
    if "waveform_file" in table:
        profile = replace(profile, waveform=Waveform(file=table.beside("waveform_file", folder)))
    if "pattern" in table:
        profile = replace(profile, pattern=_pattern(table.table("pattern"), folder))
    figures: dict[str, Any] = {
        name: kind(table.number(key, least=0, most=most))
        for key, (name, kind, most) in _NUMBERS.items()
        if key in table
    }
    for key, (kind, *limits) in _FIGURES.items():
        if key in table:
            own = table.table(key)
            read = [own.number(name, *of, least=n, most=m) for name, n, m, *of in limits]
            figures[key] = own.done(kind(*read))
    return table.done(replace(profile, **figures))


_NUMBERS: dict[str, tuple[str, Any, float]] = {
    "dark_current_e_per_s": ("dark_current", DarkCurrent, MOST_E),
    "outlier_share": ("outliers", Outliers, 1),
    "ghost": ("ghost", float, 0.5),
    "crosstalk": ("crosstalk", float, 0.8),
    "blooming": ("blooming", float, 0.9),
    "non_linearity": ("non_linearity", float, 0.5),
}
"""Numbers of a device: what of its profile they are, what they make, and their limit."""
_FIGURES: dict[str, Any] = {
    "drift": (
        Drift, ("rise_c", -1e4, 1e4), ("time_constant_s", 1e-6, 1e9),
        ("delay_s_per_c", -MOST_S, MOST_S),
    ),
    "lens_scatter": (LensScatter, ("share", 0, 0.5), ("width", 1e-6, 1e6, 0.15)),
    "jitter": (lambda *pair: pair, ("delay_s", 0, MOST_S, 0.0), ("power", 0, 0.3, 0.0)),
    "hot_pixels": (lambda *pair: pair, ("share", 0, 1), ("electrons_per_s", 0, MOST_E)),
    "noisy_pixels": (lambda *pair: pair, ("share", 0, 1), ("electrons", 0, 1e9)),
}  # fmt: skip
"""Tables of a device: what they make, and the limits of numbers, and their defaults."""


def _pattern(table: Table, folder: Path | None) -> Pattern:
    pattern = Pattern(
        delay_s=table.number("delay_s", 0.0, least=0, most=MOST_S),
        gain=table.number("gain", 0.0, least=0, most=0.3),
        file=table.beside("file", folder) if "file" in table else None,
        file_frequency_hz=table.number("file_frequency_hz", 23e6, least=1, most=1e12),
    )
    if pattern.file is not None and pattern.delay_s:
        raise table.error("delay_s", pattern.delay_s, "absent beside file, which has the delays")
    return table.done(pattern)
