"""Makes frames of captures, and has workers compute what is asked of them.

Everything here lives on the event loop and computes nothing there.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, Protocol, TypeVar

from transientcam_driver import (
    AppliedSequence,
    CalibrationMismatch,
    Capabilities,
    RawFrame,
    Simulation,
)
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.calibration import Calibration
from transientcam_server.imaging.frame import Frame
from transientcam_server.imaging.lens import Intrinsics
from transientcam_server.imaging.products import PRODUCTS, Product
from transientcam_server.imaging.recipe import Recipe, Reconstruction
from transientcam_server.settings import ReconstructionSettings

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
Judge = Callable[[Recipe, Any], dict[str, float] | None]


class Source(Protocol):
    """What a pipeline has to know of a camera."""

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        ...

    @property
    def simulation(self) -> Simulation | None:
        """Who knows the truth."""
        ...


class Pipeline:
    """Makes frames of captures and computes on ``executor`` what is asked of them.

    ``judge`` predicts the deviation of the range of each frame whose returns are computed;
    ``intrinsics`` says where the pixels of the next frame look.

    Attributes
    ----------
    reconstruction
        How frames are computed from the next one on.
    calibration
        Used for those whose sequence it is good for, from the next one on.
    """

    def __init__(
        self,
        camera: Source,
        settings: ReconstructionSettings,
        executor: Executor,
        *,
        workers: int,
        judge: Judge | None = None,
        calibration: Calibration | None = None,
        intrinsics: Callable[[], Intrinsics] | None = None,
    ) -> None:
        self.judge = judge
        self._intrinsics = intrinsics
        self.calibration = calibration
        self._capabilities = camera.capabilities
        self.reconstruction = Reconstruction(1, settings)
        self._executor = executor
        self._tasks: set[asyncio.Task[Any]] = set()
        self._frames = 0
        self._failing: set[str] = set()
        self._full_scale = 2.0**camera.capabilities.bits - 1.0
        # what may take long leaves one worker to everything else
        self._long = asyncio.Semaphore(workers - 1)
        self._truth = None if camera.simulation is None else camera.simulation.truth
        self.products = {
            name: product
            for name, product in PRODUCTS.items()
            if name != "truth" or self._truth is not None
        }

    def frame(self, raw: RawFrame, applied: AppliedSequence) -> Frame:
        """Return the next frame, counted from 1."""
        self._frames += 1
        calibration = self.calibration_for(applied)
        recipe = Recipe(
            applied,
            self.reconstruction.settings,
            self._full_scale,
            calibration,
            self.reconstruction.id,
            None if self._intrinsics is None else self._intrinsics(),
        )
        return Frame(self, self._frames, raw, recipe)

    def calibration_for(self, applied: AppliedSequence) -> Calibration | None:
        """Return the calibration given, if it is good for this sequence."""
        return self.calibration if self.misfit(applied) is None else None

    def misfit(self, applied: AppliedSequence) -> CalibrationMismatch | None:
        """Say why the calibration given is not good for a sequence; None if it is, or is none."""
        if self.calibration is None:
            return None
        return self.calibration.capture.misfit(applied, self._capabilities)

    def beside(self, camera: Source) -> "Pipeline":
        """Return one for frames of another camera, as of a recording, on the same workers."""
        other = Pipeline(camera, self.reconstruction.settings, self._executor, workers=2)
        other._long = self._long
        other._tasks = self._tasks
        return other

    def product(self, name: str) -> Product:
        """Return a product this camera has.

        Raises
        ------
        Problem
            ``unknown-product``, with the list of known ones.
        """
        try:
            return self.products[name]
        except KeyError:
            known = sorted(self.products)
            raise Problem(
                kinds.UNKNOWN_PRODUCT,
                f"There is no product {name[:64]!r}; there are {', '.join(known)}.",
                field="product",
                value=name[:64],
                known=known,
            ) from None

    async def run(self, compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
        """Return what ``compute`` gives on a worker, and the seconds it took there."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._executor, _timed, compute, *arguments)

    async def run_long(self, compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
        """Do as `run` does, but never on the last free worker."""
        async with self._long:
            return await self.run(compute, *arguments)

    def start(self, work: Coroutine[Any, Any, _T]) -> "asyncio.Task[_T]":
        """Start something that several may wait for."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._finished)
        return task

    async def close(self) -> None:
        """Abandon everything that is still being computed."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def note_failure(self, name: str, number: int) -> None:
        """Log a failure with its cause, the first of a series; call it while handling that."""
        if name not in self._failing:
            self._failing.add(name)
            _log.exception("frame %d: making %s failed", number, name)

    def note_success(self, name: str) -> None:
        """Note that a product works, so that its next failure is logged again."""
        self._failing.discard(name)

    def truth(self, device_time_s: float | None = None) -> Any:
        """Return the ground truth of the simulated scene, now or at a time; runs on a worker."""
        assert self._truth is not None  # noqa: S101 - such a camera has no product that asks
        return self._truth(device_time_s=device_time_s)

    def _finished(self, task: "asyncio.Task[Any]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # whoever waits sees it; nobody waiting is no reason to complain


def _timed(compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
    begin_s = time.perf_counter()
    value = compute(*arguments)
    return value, time.perf_counter() - begin_s
