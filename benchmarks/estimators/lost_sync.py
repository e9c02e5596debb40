"""Images that lost their synchronisation: how many are found, and errors of the range with them.

Each scene is captured twice with the simulated camera of the paper's make and the same noise: with
the share of images that lose their synchronisation, and without any. An image is corrupt where the
two differ.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.tables import Table, heads
from transientcam_driver import Sequence as Capture, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.paper.bench import DEVICE, WARM_UP_S, Bench

_ZEROTHS: Final = ("low-frequency", "on-off", "estimated")
_FREQUENCY_HZ: Final = 23e6
_OUTLIER_SHARE_OFF: Final = "&outliers=off"
_TREATMENTS: Final = ("keep", "repair", "fill")
_Array = NDArray[Any]
_STEPS: Final = 4
_COUNTS: Final = ("corrupt", "in_pairs", "repaired", "left", "missed", "wrong")


@dataclass(slots=True)
class Tally:
    """Corrupt images of one scene by what became of them, and errors in m by treatment."""

    counted: Counter[str] = field(default_factory=Counter)
    errors_m: dict[str, list[_Array]] = field(default_factory=dict)

    def row(self, name: str) -> list[str]:
        """Return what a row of the table says."""
        errors = [_error(self.errors_m[each]) for each in ("clean", *_TREATMENTS)]
        counts = [str(self.counted[each]) for each in _COUNTS]
        return [name, "{corrupt_frames} of {frames}".format(**self.counted), *counts, *errors]


def _error(errors_m: list[_Array]) -> str:
    median, most = np.percentile(np.concatenate(errors_m) * 1e3, [50, 90])
    worst = max(float(np.median(each)) for each in errors_m) * 1e3
    return f"{median:.1f} / {most:.0f} / {worst:.0f}"


def captured(spec: str, sequence: Capture, frames: int) -> tuple[_Array, list[_Array]]:
    """Return images (frames, N, H, W), and the true range of each frame."""
    clock = VirtualClock()
    with ExitStack() as stack:
        camera = stack.enter_context(open_camera(spec, clock=clock))
        clock.sleep(WARM_UP_S)
        camera.configure(sequence)
        assert camera.simulation is not None
        camera.start()
        images, ranges = [], []
        for _ in range(frames):
            images.append(camera.read_frame().images)
            ranges.append(np.asarray(camera.simulation.truth().range_m))
        return np.stack(images), ranges


def measure(scene: str, sequence: Capture, frames: int, bench: Bench, seed: int) -> Tally:
    """Capture a scene, repair its frames and count."""
    spec = f"sim:{scene}?device={DEVICE}&seed={seed}"
    images, ranges = captured(spec, sequence, frames)
    clean, _ = captured(spec + _OUTLIER_SHARE_OFF, sequence, frames)
    gains = np.asarray(bench.calibration(sequence).gains.planes)
    reconstruct = {
        each: tm.Reconstructor(
            tm.Settings(
                base_frequency_hz=sequence.base_frequency_hz,
                zeroth=sequence.zeroth,
                takes=sequence.takes,
                estimator="maximum-entropy",
                neighbours="gaussian",
                spoilt_images=each,
            ),
            calibration=gains,
        )
        for each in _TREATMENTS
    }
    tally = Tally(errors_m={each: [] for each in ("clean", *_TREATMENTS)})
    first = 2 if sequence.zeroth == "on-off" else 0
    for index in range(frames):
        corrupt = (images[index] != clean[index]).any(axis=(1, 2))
        found = tm.repair(images[index][None], zeroth=sequence.zeroth, calibration=gains)
        _count(tally, corrupt, found, first)
        before = images[index - 1] if index else None
        results = {"clean": reconstruct["keep"](clean[index])}
        for each in _TREATMENTS:
            results[each] = reconstruct[each](images[index], previous=before)
        lit = np.isfinite(ranges[index])
        for name, result in results.items():
            off = np.abs(np.asarray(result.range_m) - ranges[index])[lit]
            tally.errors_m[name].append(off[np.isfinite(off)])
    return tally


def _count(tally: Tally, corrupt: _Array, found: tm.Repair, first: int) -> None:
    """Count the images of a frame by what became of them."""
    phased = corrupt[first:].reshape((-1, _STEPS))
    repaired, unrepaired = found.repaired[0], found.unrepaired[0]
    tally.counted.update(
        frames=1,
        corrupt_frames=int(corrupt.any()),
        corrupt=int(corrupt.sum()),
        in_pairs=2 * int((phased[:, :2] & phased[:, 2:]).sum()),
        repaired=int((corrupt & repaired).sum()),
        left=int((corrupt & unrepaired).sum()),
        missed=int((corrupt & ~repaired & ~unrepaired).sum()),
        wrong=int((repaired & ~corrupt).sum()),
    )


def tables(*, frames: int = 20) -> Iterator[Table]:
    """Measure so many captures of each scene."""
    bench = Bench()
    rows: list[Sequence[str]] = []
    total = Counter[str]()
    for scene in ("wall", "mirrors", "corner", "visitor"):
        for zeroth in _ZEROTHS:
            harmonics = 3 if scene == "visitor" else 4
            exposure_s = 0.0005 if scene == "visitor" else 0.00192
            sequence = Capture(
                base_frequency_hz=_FREQUENCY_HZ,
                harmonics=harmonics,
                zeroth=zeroth,
                exposure_s=exposure_s,
            )
            tally = measure(scene, sequence, frames, bench, seed=len(rows) + 1)
            rows.append(tally.row(f"{scene}, m = {harmonics}, {zeroth}"))
            total.update(tally.counted)
    notes = [
        "In all {corrupt_frames} of {frames} frames are corrupt, by {corrupt} images: {repaired} "
        "are rebuilt, {left} are of pairs that are reported as not repaired, {missed} are not "
        "found (most of them turned by so little that noise hides it). {wrong} good images are "
        "rebuilt, which happens where the opposite one is corrupt as well.".format(**total),
        "Errors of the range in mm (maximum entropy): median and 90 % of all lit pixels, and the "
        "median of the worst frame.",
    ]
    columns = heads(
        "scene | frames corrupt | images corrupt | of these in pairs | rebuilt | reported | "
        "not found | good ones rebuilt | no image corrupt | as captured | repaired | "
        "repaired and filled"
    )
    yield Table("What becomes of corrupt images", columns, rows, notes)
