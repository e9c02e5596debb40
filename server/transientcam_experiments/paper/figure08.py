"""Figure 8: frames of a transient image, for three prices of capture time (Sec. 6.1)."""

from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, Options, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.mirrors import (
    SEQUENCES,
    SINGLE_TAKE,
    TIMES_S,
    shots,
    thrice,
    title,
)

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


def _biased(b: Array, shot: ReconstructedShot) -> float:
    least = shot.found.settings.epsilon * b[0].real
    return float((tm.smallest_eigenvalue(b) < least)[shot.lit].mean())


def biased_in_a_room(shot: ReconstructedShot, share: float) -> float:
    """Return the share of pixels that would be biased with so much light from a room around."""
    return _biased(_with_diffuse(shot, share), shot)


def _with_diffuse(shot: ReconstructedShot, share: float) -> Array:
    """Return the captured moments (m + 1, H, W) with a share of light from a room around.

    It begins with the first return and decays exponentially.
    """
    b = np.array(shot.found.smoothed)
    omega = 2 * np.pi * shot.base_frequency_hz
    j = np.arange(len(b))[:, None, None]
    first = np.exp(1j * j * omega * np.nan_to_num(shot.truth.delay_s[0]))
    room = b[0].real * first / (1 - 1j * j * omega * _DIFFUSE_DECAY_S)
    mixed: Array = (1 - share) * b + share * room
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


_RATES_HZ: Final = {"a": 11.0, "b": 0.44, "c": 0.12}
"""As the paper prints them."""


def make(bench: Bench) -> FigureResult:
    """Capture the mirrors three times, and once more as in Figure 1."""
    captures = {name: shots(bench, sequence, frames=2) for name, sequence in SEQUENCES.items()}
    captures["1"] = shots(bench, SINGLE_TAKE, frames=2)
    return FigureResult(
        _draw({name: captures[name][0] for name in SEQUENCES}),
        _statements(captures),
        (_table(captures), why_biased(bench), with_a_room(captures)),
        _remarks(captures),
    )


def _density(shot: ReconstructedShot) -> Array:
    """Return the density (3, H, W) in DN/ns."""
    return np.asarray(shot.found.density(np.array(TIMES_S))) * 1e-9


def _noise(pair: list[ReconstructedShot]) -> float:
    """Return the typical relative difference of two captures where the frames have light."""
    one, other = (_density(shot) for shot in pair)
    bright = one + other > np.percentile(one + other, 75, axis=(1, 2), keepdims=True)
    relative = 2 * np.abs(one - other) / np.maximum(one + other, 1e-30)
    return float(np.median(relative[bright]))


def _heights(shot: ReconstructedShot) -> Array:
    """Return the density (P) of each pixel's highest peak over its brightness, in 1/ns."""
    highest = shot.found.peaks.density.max(axis=0) / shot.found.brightness
    height: Array = highest[shot.lit] * 2 * np.pi * shot.base_frequency_hz * 1e-9
    return height


def _separated(shot: ReconstructedShot, *, threshold: float = 0.0) -> float:
    """Return the share of pixels with three returns whose density peaks near each of them.

    However low, without a threshold relative to the highest: the height of a peak depends on its
    sharpness more than of its light.
    """
    where = thrice(shot)
    phase = tm.peaks(shot.found.coefficients, threshold=threshold).phase_rad[:, where]
    near = []
    for k in range(3):
        true = 2 * np.pi * shot.base_frequency_hz * shot.truth.delay_s[k][where]
        near.append((np.abs(phase - true) < 2 * np.pi * shot.base_frequency_hz * 1e-9).any(axis=0))
    return float(np.all(near, axis=0).mean())


def _stray(shot: ReconstructedShot) -> float:
    """Return the share of the light of all frames in pixels without a return within 1 ns."""
    light = _density(shot)
    apart = np.abs(shot.truth.delay_s - np.array(TIMES_S)[:, None, None, None])
    empty = ~(np.nan_to_num(apart, nan=1.0) < 1e-9).any(axis=1)
    return float(light[empty].sum() / light.sum())


def _shadow_of_two(shot: ReconstructedShot) -> float:
    """Return how much brighter than around it the shadow of the 2 is at 11.3 ns, light by light.

    Over pixels that get direct light near that time: density over direct light, where the second
    return is missing over where it is there.
    """
    truth = shot.truth
    share = _density(shot)[0] / np.maximum(truth.direct, 1e-30)
    near = np.abs(truth.delay_s[0] - TIMES_S[0]) < 0.4e-9
    second = np.where((truth.delay_s > 17e-9) & (truth.delay_s < 22e-9), truth.weight, 0).sum(
        axis=0
    )
    missing = near & (second == 0)
    there = near & (second > 0.2 * truth.direct)
    if not missing.any() or not there.any():
        return float("nan")
    return float(np.median(share[missing]) / np.median(share[there]))


def _statements(captures: dict[str, list[ReconstructedShot]]) -> list[Statement]:
    first = {name: pair[0] for name, pair in captures.items()}
    heights = {name: float(np.median(_heights(first[name]))) for name in SEQUENCES}
    noise = {name: _noise(pair) for name, pair in captures.items()}
    takes = first["b"].applied.sequence.takes
    biased = {name: biased_in_a_room(first[name], ROOM) for name in "ac"}
    rate = max(
        abs(
            1
            / (
                first[name].applied.capture_s
                / first[name].applied.sequence.takes
                * SEQUENCES[name].takes
            )
            / hz
            - 1
        )
        for name, hz in _RATES_HZ.items()
    )
    return [
        state("08.rates", rate),
        state("08.separated", _separated(first["a"])),
        state("08.m4_sharper", heights["b"] / heights["a"]),
        state("08.m8_sharper", heights["c"] / heights["a"]),
        state("08.artefacts", _stray(first["c"]) / _stray(first["b"])),
        state("08.m8_biased", biased["c"], room=ROOM),
        state("08.m3_biased", biased["a"], room=ROOM, share=_share(first["a"])),
        state("08.averaging", noise["1"] / noise["b"], takes=takes),
        state("08.single_take", noise["a"] / noise["1"]),
        state("08.shadow", abs(_shadow_of_two(first["a"]) - 1)),
    ]


def _remarks(captures: dict[str, list[ReconstructedShot]]) -> list[str]:
    """Return remarks on other measures."""
    first = {name: captures[name][0] for name in SEQUENCES}
    shares = ", ".join(
        f"{_separated(shot, threshold=0.1):.0%} in ({name})" for name, shot in first.items()
    )
    ratio = float(np.median(_heights(first["c"])) / np.median(_heights(first["b"])))
    return [
        "A peak counts as one however low it is. Where only peaks of a tenth of the highest "
        f"density count, as for the range, all three are there in {shares} of these pixels: a "
        "sharp strong return towers above broad weak ones.",
        f"Against (b) the peaks of (c) are {ratio:.2f} times as high: at half the base frequency "
        "the same phase is twice the time.",
    ]


def _share(shot: ReconstructedShot) -> float:
    flags = np.asarray(shot.found.flags)[shot.lit]
    return float(((flags & int(tm.Flags.BIASED)) != 0).mean())


def _table(captures: dict[str, list[ReconstructedShot]]) -> Table:
    rows = [
        {
            "captured with": "Fig. 1: m = 4, single take" if name == "1" else title(name),
            "takes": pair[0].applied.sequence.takes,
            "capture / s": pair[0].applied.capture_s,
            "three returns separated / %": 100 * _separated(pair[0]),
            "height of the highest peak / (1/ns)": float(np.median(_heights(pair[0]))),
            "light beside the wave / %": 100 * _stray(pair[0]),
            "difference of two captures / %": 100 * _noise(pair),
            "biased / %": 100 * _share(pair[0]),
            "images left out as outliers": pair[0].found.rejected_images,
        }
        for name, pair in captures.items()
    ]
    return Table.of("Three prices", rows)


def _draw(first: dict[str, ReconstructedShot]) -> Any:
    with style.new(10.0, 7.6) as picture:
        rows: Any = picture.subfigures(3, 1)
        for part, (name, shot) in zip(rows, first.items(), strict=True):
            part.suptitle(title(name), fontsize=9.5, x=0.02, ha="left")
            panels = part.subplots(1, 3)
            density = _density(shot)
            for axes, frame, time_s in zip(panels, density, TIMES_S, strict=True):
                style.show(
                    axes, frame, f"τ = {time_s * 1e9:.1f} ns", most=float(np.percentile(frame, 99))
                )
                style.scale(part, axes, "DN/ns")
    return picture


FIGURE: Final = figure(8, make)
