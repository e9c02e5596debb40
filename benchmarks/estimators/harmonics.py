"""Harmonics of the modulation: errors before and after they are taken out, by modulation.

The simulated camera modulates by a square wave, whose correlation with itself is a triangle, and by
a measured waveform where a file of one is given: (rows, samples) over one period, opposite rows in
pairs. Each is calibrated through the diffuser with a phase sweep. The mean of many takes then shows
what noise does not explain.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.data import PAPER, SETTINGS, VGA, images
from benchmarks.common.tables import Table, heads
from transientcam_driver import Camera, Sequence as Capture, SubPhases, Truth, capture_calibration
from transientcam_driver.calibration import DEFAULT_TAKES
from transientcam_driver.cameras.open_usb import UsbCamera, open_transport
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Calibration, SweepEvaluation, evaluate
from transientcam_simulation.base import DeviceProfile, Pattern, Waveform
from transientcam_simulation.emulated import DEFAULT_HEIGHT, DEFAULT_WIDTH, build, find_scene
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus

_TAKES: Final = 16
_FRAMES: Final = 15
_LANES: Final = ("measure", "smooth", "smallest_eigenvalue", "levinson", "harmonics", "reconstruct")
_SEQUENCE: Final = Capture(harmonics=4, takes=_TAKES)
_SCENES: Final = ("wall", "mirrors", "corner")
_SCHEMES: Final = (
    SubPhases("none"),
    SubPhases("harmonic-cancellation", 3),
    SubPhases("arccos", 4),
    SubPhases("arccos", 8),
)
_PATTERN: Final = Pattern(delay_s=1.2e-9, gain=0.01)  # the prototype's
_Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Errors:
    """Of the mean of many takes: moments over b_0 (NaN where unknown), and ranges in m."""

    moments: _Array
    range_m: _Array

    def texts(self) -> list[str]:
        """Return both as columns have them."""
        worst = self.moments[np.isfinite(self.moments)]
        off = np.abs(self.range_m[np.isfinite(self.range_m)]) * 1e3
        moment = (
            "-" if not worst.size else f"{np.median(worst):.2%} / {np.percentile(worst, 90):.2%}"
        )
        return [moment, f"{np.median(off):.2f} / {np.percentile(off, 90):.1f}"]


@contextmanager
def camera_at(scene: str, waveform: Path, sequence: Capture) -> Iterator[Camera]:
    """Open a simulated camera of this waveform, as fast as it computes."""
    device = DeviceProfile("swept", waveform=Waveform(file=waveform), pattern=_PATTERN)
    clock = VirtualClock()
    emulated, simulation = build(
        replace(find_scene(scene), device=device),
        width=DEFAULT_WIDTH,
        height=DEFAULT_HEIGHT,
        seed=1,
        clock=clock,
    )
    bus = SimulatedBus([emulated])
    with UsbCamera(
        lambda serial: open_transport(serial, backend=bus), clock=clock, simulation=simulation
    ) as camera:
        camera.configure(sequence)
        yield camera


def calibration(waveform: Path, sequence: Capture) -> tuple[Calibration, str | None]:
    """Calibrate through the diffuser; also return why no harmonics are known."""
    with camera_at("calibration", waveform, sequence) as camera:
        sweep = SweepEvaluation(camera.capabilities, takes=DEFAULT_TAKES)
        capture = capture_calibration(camera, average=tm.average_takes, waveform=sweep)
    return evaluate(capture), sweep.reason


def errors(scene: str, waveform: Path, sequence: Capture, known: Calibration) -> list[Errors]:
    """Return the errors of a scene without and with the harmonics of a calibration."""
    with camera_at(scene, waveform, sequence) as camera:
        assert camera.simulation is not None
        camera.start()
        captured = camera.read_frame().images
        camera.stop()
        truth = camera.simulation.truth()
    settings = tm.Settings(
        base_frequency_hz=sequence.base_frequency_hz,
        zeroth=sequence.zeroth,
        takes=sequence.takes,
        estimator="maximum-entropy",
        neighbours="gaussian",
    )
    gains = known.gains
    found = []
    for each in (None, gains.waveform):
        result = tm.reconstruct(captured, settings, calibration=gains.planes, waveform=each)
        off_m = np.asarray(result.range_m) - truth.range_m
        found.append(Errors(_moment_errors(np.asarray(result.smoothed), truth, sequence), off_m))
    return found


def _moment_errors(moments: _Array, truth: Truth, sequence: Capture) -> _Array:
    """Return the worst error of b_1 .. b_m over b_0 where the truth has all returns."""
    if truth.kind != "sparse":
        return np.full(moments.shape[1:], np.nan)
    turn = 2j * np.pi * sequence.base_frequency_hz * np.nan_to_num(truth.delay_s)
    with np.errstate(divide="ignore", invalid="ignore"):
        true = np.stack(
            [(truth.weight * np.exp(j * turn)).sum(axis=0) for j in range(len(moments))]
        )
        # relative brightness is the weights' in both
        true = true / true[0].real
        error = np.abs(moments / moments[0].real - tm.smooth(true)).max(axis=0)
    # where neighbours differ, light of both is smoothed by their brightness
    smooth_here = np.abs(tm.smooth(true) - true).max(axis=0) < 1e-3
    return np.where(smooth_here, error, np.nan)


def waveforms(folder: Path, measured: Path | None) -> dict[str, Path]:
    """Return files of correlation functions by their names."""
    samples = 2048
    turn = np.arange(samples) / samples
    np.save(folder / "square.npy", (1 - 4 * np.abs(turn - 0.5))[None])
    found = {"square wave": folder / "square.npy"}
    return found if measured is None else found | {f"measured ({measured.stem})": measured}


def table(measured: Path | None) -> Table:
    """Measure all scenes and modulations."""
    rows: list[Sequence[str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, path in waveforms(Path(folder), measured).items():
            for scheme in _SCHEMES:
                sequence = replace(_SEQUENCE, sub_phases=scheme)
                known, reason = calibration(path, sequence)
                waveform = known.gains.waveform
                largest = "too strong" if waveform is None else f"{np.abs(waveform).max():.2%}"
                assert waveform is not None or reason is not None
                for scene in _SCENES:
                    plain, without = errors(scene, path, sequence, known)
                    label = scheme.scheme + (f" {scheme.n}" if scheme.n > 1 else "")
                    (b, r), (b_out, r_out) = plain.texts(), without.texts()
                    rows.append([f"{name}, {label}, {scene}", largest, b, b_out, r, r_out])
    columns = heads(
        "modulation, sub-phases, scene | largest harmonic | moments, calibrated | "
        "harmonics taken out | range in mm, calibrated | harmonics taken out"
    )
    return Table("Before and after", columns, rows)


def cost() -> Table:
    """Measure the processor time of a frame without and with the correction."""
    rows = []
    for m, shape in ((3, PAPER), (4, PAPER), (4, VGA)):
        tm.kernels.compile([m], ["float32"], names=_LANES)
        raw = images(m, shape)
        gains = np.exp(0.2j * np.random.default_rng(m).normal(size=(m + 1, *shape)))
        times_ms = []
        for waveform in (None, np.tile(0.01 / np.arange(1, 5), (m, 1))):
            reconstruct = tm.Reconstructor(SETTINGS, calibration=gains, waveform=waveform)
            times_ms.append(1e3 * _processor_s(lambda: reconstruct(raw)))  # noqa: B023 - called now
        rows.append([f"m = {m}, {shape[1]} x {shape[0]}", *times_ms])
    notes = ["Processor time of a frame in single precision, with four harmonics."]
    columns = heads("frame | calibrated, ms:.1f | harmonics taken out, ms:.1f")
    return Table("What it costs", columns, rows, notes)


def _processor_s(frame: Callable[[], object]) -> float:
    frame()
    measured = []
    for _ in range(_FRAMES):
        begin_s = time.process_time()
        frame()
        measured.append(time.process_time() - begin_s)
    return float(np.median(measured))


def tables(*, waveform: Path | None = None) -> Iterator[Table]:
    """Measure a square wave, and a measured correlation function where its .npy is given."""
    yield table(waveform)
    yield cost()
