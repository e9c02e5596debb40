"""How long a worker of the daemon reconstructs a frame on this machine, measured on first use."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Capabilities, Sequence
from transientcam_server.settings import ReconstructionSettings

_REPEATED: Final = 3
_ENOUGH_S: Final = 0.05
"""What takes longer is timed once."""
_OF_FRAMES: Final = ("reconstruct", "measure", "separate")
"""Kernels that frames need beside averaging, by the number of their harmonics."""
_OF_ESTIMATOR: Final = {"likelihood": ("likelihood",), "maximum-entropy": ("peaks",)}
"""And their range."""
_DEPTH: Final = 1000.0
"""Brightness of the images that are reconstructed, in DN."""


class ReconstructionTimer:
    """Processor time in s from images to range, by estimator, number of harmonics and takes.

    That of one thread, as of a worker of the daemon, whatever else the machine does.

    ``capabilities``: of the camera: the size of its images.
    ``settings``: of the reconstruction, but for the estimator.
    ``clock``: of the thread that computes.
    """

    def __init__(
        self,
        capabilities: Capabilities,
        settings: ReconstructionSettings,
        *,
        clock: Callable[[], float] = time.thread_time,
    ) -> None:
        self._shape = (capabilities.height, capabilities.width)
        self._full_scale = 2.0**capabilities.bits - 1.0
        self._settings = settings
        self._clock = clock
        self._known: dict[tuple[str, int, int], float] = {}

    def __call__(
        self, sequence: Sequence, estimator: str, compiling: Callable[[str], None] | None = None
    ) -> float | None:
        """Return the time of one frame of a sequence; averaging grows with the number of takes.

        None as long as kernels that it needs are not compiled: without them it takes up to fifty
        times as long, which is no figure of the daemon, that compiles them when they are needed.
        ``compiling`` takes that step, which is then done, once on a machine.
        """
        names = self._kernels_of(estimator)
        if not tm.kernels.settled(names, sequence.harmonics):
            if compiling is None:
                return None
            compiling(f"compiling kernels for m = {sequence.harmonics}")
            tm.kernels.compile([sequence.harmonics], ["float32"], names=names)
        once = self._measured(estimator, sequence.harmonics, 1)
        if sequence.takes == 1:
            return once
        # 2 takes are averaged plainly, more are searched for outliers
        few = 2 if sequence.takes == 2 else 3
        several = self._measured("single-frequency", 1, few)
        averaging = max(0.0, several - self._measured("single-frequency", 1, 1)) / (4 * few)
        return once + averaging * 4 * sequence.harmonics * sequence.takes

    def _kernels_of(self, estimator: str) -> tuple[str, ...]:
        averaging = "neighbours" if self._settings.neighbours == "edge-preserving" else "smooth"
        return (*_OF_FRAMES, averaging, *_OF_ESTIMATOR.get(estimator, ()))

    def _measured(self, estimator: str, harmonics: int, takes: int) -> float:
        key = (estimator, harmonics, takes)
        if key not in self._known:
            images = _images(harmonics, takes, self._shape)
            settings = self._settings.model_copy(update={"estimator": estimator}).for_moments(
                base_frequency_hz=23e6,
                zeroth="estimated",
                takes=takes,
                full_scale=self._full_scale,
                sensor=tm.noise.Sensor(),
            )
            with ThreadPoolExecutor(1, initializer=tm.kernels.use_one_thread) as worker:
                timed = worker.submit(self._least, images, settings, np.ones(harmonics + 1))
                self._known[key] = timed.result()
        return self._known[key]

    def _least(
        self, images: NDArray[Any], settings: tm.Settings, gains: NDArray[np.float64]
    ) -> float:
        each = [self._once(images, settings, gains)]
        while len(each) < _REPEATED and each[0] < _ENOUGH_S:
            each.append(self._once(images, settings, gains))
        return min(each)

    def _once(
        self, images: NDArray[Any], settings: tm.Settings, gains: NDArray[np.float64]
    ) -> float:
        begin_s = self._clock()
        found = tm.reconstruct(images, settings, calibration=gains)
        _ = found.range_m, found.direct, found.flags
        return self._clock() - begin_s


def computing_s(
    capabilities: Capabilities,
    settings: str,
    compiling: Callable[[str], None] | None,
    sequence: Sequence,
    estimator: str,
) -> float | None:
    """Return what the timer of this process says, which keeps what it has measured.

    ``settings``: Of the reconstruction, as JSON.
    """
    return _timer_of(capabilities, settings)(sequence, estimator, compiling)


@lru_cache(maxsize=8)
def _timer_of(capabilities: Capabilities, settings: str) -> ReconstructionTimer:
    return ReconstructionTimer(capabilities, ReconstructionSettings.model_validate_json(settings))


def _images(harmonics: int, takes: int, shape: tuple[int, int]) -> NDArray[Any]:
    """Make images of two returns a pixel with noise, as a scene might have them."""
    random = np.random.default_rng(harmonics)
    phase = random.uniform(0.0, 2 * np.pi, (2, *shape))
    weight = _DEPTH * random.uniform(0.3, 0.7, (2, *shape))
    images = []
    for j in range(1, harmonics + 1):
        moment = (weight * np.exp(1j * j * phase)).sum(axis=0)
        for step in range(4):
            images.append(0.5 * (weight.sum(axis=0) + (moment * (-1j) ** step).real))
    stack = np.stack(images * takes)
    noisy = stack + random.normal(0.0, 8.0, stack.shape)
    return np.maximum(noisy, 0.0).astype(np.uint16)
