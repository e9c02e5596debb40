"""The corner of Figure 12 through a coded waveform: the simulated camera takes it as its own."""

import re
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence, SubPhases, list_scenes
from transientcam_experiments.paper.bench import Array, Bench
from transientcam_moments.comparisons import Code, coded as estimate, maximum_length_code

SEQUENCE: Final = Sequence(
    base_frequency_hz=11.5e6, harmonics=8, zeroth="estimated", takes=4, sub_phases=SubPhases("none")
)
"""The code repeated with eight frequencies, four shifts each: 32 images a take."""
HARMONICS: Final = 9
"""Of the code, that the simulated device takes."""
_WAVE: Final = 1024
_AMBIENT: Final = 4.5e6
"""Unmodulated light in electrons a second: it fills what the code's low fundamental leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class CodedCapture:
    """Samples (N, H, W) in DN of the code's correlation, as the estimator takes them.

    ``truth_m`` (H, W) is the true range.
    """

    samples: Array
    shifts_rad: Array
    harmonics: Array
    code: Code
    truth_m: Array

    def range_m(self, step: int) -> Array:
        """Return the range of every ``step``-th pixel both ways, NaN where none is found."""
        found = estimate(
            self.samples[:, ::step, ::step],
            code=self.code,
            shifts_rad=self.shifts_rad,
            harmonics=self.harmonics,
        )
        range_m: Array = tm.range_m(found.first_phase_rad(), SEQUENCE.base_frequency_hz)
        return range_m


def capture(bench: Bench) -> CodedCapture:
    """Capture the corner with an ideal device that is modulated by the code.

    The light is weakened by the number of harmonics, which the device takes relative to the
    fundamental: the whole waveform then swings as far as a sinusoid's.
    """
    contents = maximum_length_code().contents[:HARMONICS]
    with TemporaryDirectory() as folder:
        scene = _write(Path(folder), contents)
        images, truth = bench.raw(f"{scene}?seed={bench.seed}", bench.sequence(SEQUENCE))
    takes = bench.sequence(SEQUENCE).takes
    mean = images.reshape((takes, SEQUENCE.harmonics, 4, *images.shape[1:])).mean(axis=0)
    # opposite images: their difference has the odd harmonics alone
    samples = np.concatenate([mean[:, 0] - mean[:, 2], mean[:, 1] - mean[:, 3]])
    smoothed = np.real(tm.smooth(samples.astype(np.complex64))).astype(np.float64)
    odd = np.where(np.arange(1, HARMONICS + 1) % 2, contents / contents[0], 0)
    multiples = np.arange(1, SEQUENCE.harmonics + 1)
    return CodedCapture(
        smoothed,
        np.repeat([0.0, np.pi / 2], SEQUENCE.harmonics),
        np.tile(multiples, 2),
        Code(odd),
        truth.first_return_m,
    )


def _write(folder: Path, contents: Array) -> Path:
    """Write the corner with a device of its own, its light weakened, and other light."""
    phase = 2 * np.pi * np.arange(_WAVE) / _WAVE
    orders = np.arange(1, HARMONICS + 1)
    wave = np.real(np.exp(1j * phase[:, None] * orders) @ contents)
    np.save(folder / "code.npy", wave[None])
    (corner,) = (each.path for each in list_scenes() if each.name == "corner")
    text = corner.read_text(encoding="utf-8")
    electrons = float(re.findall(r"electrons_per_s = ([\d.e]+)", text)[0])
    weaker = f"electrons_per_s = {electrons / HARMONICS:g}"
    text = re.sub(r"electrons_per_s = [\d.e]+", weaker, text, count=1)
    text += f'\n[ambient]\nelectrons_per_s = {_AMBIENT:g}\n\n[device]\nwaveform_file = "code.npy"\n'
    scene = folder / "coded.toml"
    scene.write_text(text, encoding="utf-8")
    return scene
