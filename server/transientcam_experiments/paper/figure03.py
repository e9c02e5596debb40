"""Figure 3: phase steps inside the exposure make any modulation sinusoidal (Sec. 4.1)."""

from dataclasses import dataclass
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence, SubPhases
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S, Scheme
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_server.errors import InputError

_F_HZ: Final = 23e6
_WIDTH, _HEIGHT = 163, 120
_SAMPLES: Final = 2048
_THIRD: Final = 0.111
"""Third harmonic of the CamBoard nano family at 23 MHz, as measured."""
_HIGHEST: Final = 9
"""Of the harmonics that the simulated device takes of a waveform."""
_SHOWN: Final = (("none", 1), ("arccos", 8), ("harmonic-cancellation", 3))
_SCENE: Final = Path(__file__).with_name("delays.toml")


@dataclass(frozen=True, slots=True)
class Steps:
    """Phase steps: their kind and number."""

    kind: Scheme
    n: int

    @property
    def label(self) -> str:
        """In words."""
        return "as it is" if self.kind == "none" else f"{self.kind.replace('-', ' ')}, n = {self.n}"


def make(bench: Bench) -> FigureResult:
    """Sweep the delay over one period, a column of pixels each, and capture with phase steps."""
    steps = (1, 8) if bench.quick else (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
    schemes = [Steps("none", 1)]
    schemes += [Steps("arccos", n) for n in steps]
    schemes += [Steps("harmonic-cancellation", n) for n in ((3,) if bench.quick else (1, 2, 3, 4))]
    curves = {
        name: {scheme: measured(bench, wave, scheme) for scheme in schemes}
        for name, wave in _waveforms(bench).items()
    }
    tables = [_table(name, each) for name, each in curves.items()]
    return FigureResult(_draw(curves), _statements(curves), tables, _remarks(curves))


def _waveforms(bench: Bench) -> dict[str, Array]:
    phase = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    waveforms = {
        "triangle": 2 / np.pi * np.arcsin(np.cos(phase)),
        "CamBoard nano": np.cos(phase) + _THIRD * np.cos(3 * phase),
    }
    if bench.waveform is not None:
        rows = _rows(bench.waveform)
        waveforms[bench.waveform.stem] = rows[0] - rows[1] if len(rows) % 2 == 0 else rows[0]
    return waveforms


def _rows(path: Path) -> Array:
    """Read a measured correlation function. Raises InputError where the file holds none."""
    try:
        rows = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(str(path), "the file", str(error), "a .npy") from error
    if not isinstance(rows, np.ndarray) or rows.ndim != 2 or rows.dtype.kind not in "iuf":
        found = f"of shape {np.shape(rows)}"
        raise InputError(str(path), "the array", found, "numbers (rows, samples) over one period")
    return rows.astype(float)


def measured(bench: Bench, wave: Array, scheme: Steps) -> Array:
    """Return the effective modulation over one period of delays, measured over USB: (W).

    The difference of opposite images, which is what four-bucket sampling uses.
    """
    sequence = Sequence(
        base_frequency_hz=_F_HZ,
        harmonics=1,
        zeroth="estimated",
        sub_phases=SubPhases(scheme.kind, scheme.n),
    )
    with TemporaryDirectory() as folder:
        scene = _write(Path(folder), wave)
        images, _ = bench.raw(f"{scene}?noise=off&modulation-harmonics=on", sequence)
    difference: Array = (images[0].astype(float) - images[2]).mean(axis=0)
    return difference


def _write(folder: Path, wave: Array) -> Path:
    """Write a scene: column x of the sensor sees one return, x / W of a period late.

    Light that is spread evenly over the period is modulated by nothing, and keeps a waveform that
    swings wider than its fundamental from the lower end of the converter.
    """
    h = np.eye(_WIDTH, dtype=np.float32)[None] + np.float32(0.5 / _WIDTH)
    bin_opl_m = SPEED_OF_LIGHT_M_S / _F_HZ / _WIDTH
    np.savez(folder / "delays.npz", h=h, start_opl_m=0.0, bin_opl_m=bin_opl_m)
    np.save(folder / "waveform.npy", wave[None])
    scene = folder / "delays.toml"
    copyfile(_SCENE, scene)
    return scene


def _spectrum(curve: Array) -> Array:
    spectrum = np.abs(np.fft.rfft(curve))[: _HIGHEST + 1]
    relative: Array = spectrum / spectrum[1]
    return relative


def _distortion(curve: Array) -> float:
    return float(np.sqrt((_spectrum(curve)[2:] ** 2).sum()))


def _statements(curves: dict[str, dict[Steps, Array]]) -> list[Statement]:
    triangle = curves["triangle"]
    arccos = [_distortion(curve) for scheme, curve in triangle.items() if scheme.kind == "arccos"]
    cancelled = max(
        float(_spectrum(curve)[3 : 2 * scheme.n].max())
        for each in curves.values()
        for scheme, curve in each.items()
        if scheme.kind == "harmonic-cancellation" and scheme.n > 1
    )
    times = {
        Sequence(sub_phases=SubPhases(scheme.kind, scheme.n)).capture_s(3.73e-3)
        for scheme in triangle
    }
    at_eight = {name: _distortion(each[Steps("arccos", 8)]) for name, each in curves.items()}
    return [
        state("03.triangle", at_eight["triangle"]),
        state(
            "03.in_practice", max(value for name, value in at_eight.items() if name != "triangle")
        ),
        state("03.limit", arccos[-1] / arccos[0]),
        state("03.cancellation", cancelled),
        state("03.no_longer", len(times)),
    ]


def _remarks(curves: dict[str, dict[Steps, Array]]) -> list[str]:
    """Return a remark on where the rival is better."""
    remarks = []
    for name, each in curves.items():
        ours = _distortion(each[Steps("arccos", 8)])
        rival = _distortion(each[Steps("harmonic-cancellation", 3)])
        better = "less than" if rival < ours else "more than"
        remarks.append(
            f"On the waveform `{name}` harmonic cancellation with n = 3 leaves {rival:.2%}, "
            f"{better} arccos sampling with n = 8 ({ours:.2%})."
        )
    return [
        *remarks,
        "Cancellation is exact here because the simulated device keeps its phase steps exactly; "
        "the paper's had timing issues beyond n = 3, which are not simulated.",
    ]


def _table(name: str, curves: dict[Steps, Array]) -> Table:
    rows = []
    for scheme, curve in curves.items():
        spectrum = _spectrum(curve)
        gain = np.abs(_gain(scheme, np.array([1, 3, 5, 7])))
        rows.append(
            (
                scheme.label,
                _percent(_distortion(curve)),
                *map(_percent, spectrum[3:8:2]),
                float(gain[0]),
            )
        )
    columns = ("phase steps", "distortion", "3rd", "5th", "7th", "gain of the fundamental")
    return Table(f"{name}: harmonics over the fundamental, measured over USB", columns, rows)


def _gain(scheme: Steps, harmonics: Array) -> Array:
    steps = SubPhases(scheme.kind, scheme.n)
    gain: Array = tm.modulation_gain(harmonics, steps.phases_rad, np.array(steps.weights))
    return gain


def _percent(value: float) -> str:
    return f"{value:.3%}"


def _draw(curves: dict[str, dict[Steps, Array]]) -> Any:
    with style.new(11.0, 2.9 * len(curves)) as picture:
        grid = picture.subplots(len(curves), 3, squeeze=False)
        for (name, each), row in zip(curves.items(), grid, strict=True):
            _draw_curves(row[0], row[1], name, each)
            _draw_distortion(row[2], name, each)
    return picture


def _draw_curves(curve: Any, rest: Any, name: str, each: dict[Steps, Array]) -> None:
    phase = np.degrees(2 * np.pi * np.arange(_WIDTH) / _WIDTH)
    colours = (style.NOISY, style.OURS, style.OTHER)
    for key, colour in zip(_SHOWN, colours, strict=True):
        scheme = Steps(*key)  # type: ignore[arg-type]  # the tuple's words are schemes
        wave = each[scheme]
        spectrum = np.fft.rfft(wave)
        turn = np.exp(-1j * np.angle(spectrum[1]) * np.arange(spectrum.size))
        aligned = np.fft.irfft(spectrum * turn, wave.size) / (2 * abs(spectrum[1]) / wave.size)
        curve.plot(phase, aligned, color=colour, label=scheme.label)
        rest.plot(phase, 100 * (aligned - np.cos(np.radians(phase))), color=colour)
    curve.set(title=f"{name}: effective modulation", xlabel="phase / degrees", xlim=(0, 360))
    curve.set(xticks=range(0, 361, 90), ylabel="over the fundamental")
    curve.set_ylim(-1.3, 2.2)
    curve.legend(loc="upper center")
    rest.set(title="difference from a sinusoidal", xlabel="phase / degrees", xlim=(0, 360))
    rest.set(xticks=range(0, 361, 90), ylabel="% of the fundamental")


def _draw_distortion(axes: Any, name: str, each: dict[Steps, Array]) -> None:
    for kind, colour, marker in (
        ("arccos", style.OURS, "o"),
        ("harmonic-cancellation", style.OTHER, "s"),
    ):
        mine = [
            (scheme.n, _distortion(curve)) for scheme, curve in each.items() if scheme.kind == kind
        ]
        n, distortion = zip(*mine, strict=True)
        axes.loglog(
            n,
            100 * np.array(distortion),
            marker=marker,
            color=colour,
            markersize=4,
            label=kind.replace("-", " "),
        )
    axes.axhline(100 * _distortion(each[Steps("none", 1)]), color=style.NOISY, label="as it is")
    axes.set(
        title="total harmonic distortion", xlabel="phase steps n", ylabel="% of the fundamental"
    )
    axes.set(xticks=[1, 2, 4, 8, 16, 32], xticklabels=["1", "2", "4", "8", "16", "32"])
    axes.minorticks_off()
    axes.legend()


FIGURE: Final = figure(3, make)
