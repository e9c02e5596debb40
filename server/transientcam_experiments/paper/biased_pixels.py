"""Why pixels of the mirrors are biased: errors of the device, and too little diffuse light."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_experiments.paper.bench import Bench, Options, ReconstructedShot
from transientcam_experiments.paper.figure import Table
from transientcam_experiments.paper.mirrors import SEQUENCES, title

_Array = NDArray[Any]
_DEVICES: Final[dict[str, Options]] = {
    "as captured": {},
    "pure sinusoids": {"modulation-harmonics": "off", "lens-scatter": "off"},
}
"""The camera with what its phase steps leave of the harmonics and its lens scatters, and "
"without."""
_DIFFUSE_DECAY_S: Final = 10e-9
"""Of the light of a room, whose walls are a few metres apart."""
_DIFFUSE_SHARES: Final = (0.0, 0.05, 0.1, 0.2)
ROOM: Final = 0.1
"""Share of diffuse light that the statements on biasing are looked at with."""


def why_biased(bench: Bench) -> Table:
    """Return the share of biased pixels with some errors of the device taken away."""
    shares = {name: _shares_with(bench, name) for name in ("b", "c")}
    rows = [
        (title(name), *(100 * share for share in each.values())) for name, each in shares.items()
    ]
    columns = ("captured with", *shares["b"])
    return Table(
        "Share of lit pixels whose smallest eigenvalue is below 0.4 % of b_0, in %", columns, rows
    )


def _shares_with(bench: Bench, name: str) -> dict[str, float]:
    """Return the share of biased pixels, as captured and without some of the device's errors."""
    shares = {}
    for device, options in _DEVICES.items():
        shot = bench.shot("mirrors", SEQUENCES[name], options=options)
        b = np.array(shot.found.smoothed)
        shares[device] = _biased(b, shot)
        b[0] = shot.truth.brightness
        shares[f"{device}, true b_0"] = _biased(b, shot)
    return shares


def _biased(b: _Array, shot: ReconstructedShot) -> float:
    least = shot.found.settings.epsilon * b[0].real
    return float((tm.smallest_eigenvalue(b) < least)[shot.lit].mean())


def biased_in_a_room(shot: ReconstructedShot, share: float) -> float:
    """Return the share of pixels that would be biased with so much light from a room around."""
    return _biased(_with_diffuse(shot, share), shot)


def _with_diffuse(shot: ReconstructedShot, share: float) -> _Array:
    """Return the captured moments (m + 1, H, W) with a share of light from a room around.

    It begins with the first return and decays exponentially.
    """
    b = np.array(shot.found.smoothed)
    omega = 2 * np.pi * shot.base_frequency_hz
    j = np.arange(len(b))[:, None, None]
    first = np.exp(1j * j * omega * np.nan_to_num(shot.truth.delay_s[0]))
    room = b[0].real * first / (1 - 1j * j * omega * _DIFFUSE_DECAY_S)
    mixed: _Array = (1 - share) * b + share * room
    return mixed


def with_a_room(captures: dict[str, list[ReconstructedShot]]) -> Table:
    """Return the share of biased pixels with more and more diffuse light."""
    rows = []
    for name in SEQUENCES:
        shot = captures[name][0]
        shares = (100 * biased_in_a_room(shot, share) for share in _DIFFUSE_SHARES)
        rows.append((title(name), *shares))
    return Table(
        "The same with diffuse light added to the captured moments: a part of all light that "
        f"begins with the first return and decays in {_DIFFUSE_DECAY_S * 1e9:.0f} ns",
        ("captured with", *(f"{share:.0%} diffuse" for share in _DIFFUSE_SHARES)),
        rows,
    )
