"""The scene before the daemon's camera, as plans see it; kept for ten seconds."""

import asyncio
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Final, Protocol

from transientcam_driver import Camera, Sequence
from transientcam_server.imaging import Frame, Workers
from transientcam_server.planning._planner import Planner
from transientcam_server.planning._process.queue import PlanningQueue, Progress
from transientcam_server.planning._scene.look import look_of_frame
from transientcam_server.planning._scene.scene import SceneStatistics

CACHED_S: Final = 10.0


class CameraTwin(Protocol):
    """A simulated camera before the same scene, in virtual time; it is pickled."""

    def open(self) -> AbstractContextManager[Camera]:
        """Open it."""
        ...


class Looks:
    """Looks at the present scene; on the event loop, computed elsewhere.

    A simulated camera has a twin that looks in its place, so that frames go on undisturbed and no
    busy machine loses images. Of any other camera the current frame has to be enough.
    ``calibrated_c`` returns the temperature of the camera at the calibration in use, if known.
    """

    def __init__(
        self,
        planner: Planner,
        workers: Workers,
        queue: PlanningQueue,
        twin: Callable[[], CameraTwin] | None,
        *,
        calibrated_c: Callable[[], float | None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._planner = planner
        self._workers = workers
        self._queue = queue
        self._twin = twin
        self._calibrated_c = calibrated_c
        self._clock = clock
        self._cached: tuple[tuple[object, ...], float, SceneStatistics] | None = None
        self._looking = asyncio.Lock()

    @property
    def needs_frame(self) -> bool:
        """Whether the current frame is what is looked at."""
        return self._twin is None

    async def of_twin(
        self, base: Sequence, ambient_dn_per_s: float | None, progress: Progress
    ) -> SceneStatistics:
        """Return the scene by the twin of a simulated camera; ``progress`` may raise to end it.

        Raises Problem: ``target-unreachable`` where the scene has no light, or too much.
        """
        assert self._twin is not None  # noqa: S101 - callers look at `needs_frame`
        self._planner.require_possible()
        async with self._looking:
            cached, key = self._cached, (base, ambient_dn_per_s, self._calibrated_c())
            if cached is None or cached[0] != key or self._clock() > cached[1]:
                scene = await self._queue.run(
                    look_through, self._planner, self._twin(), *key, progress=progress
                )
                cached = self._cached = (key, self._clock() + CACHED_S, scene)
            return cached[2]

    async def of_frame(self, frame: Frame, ambient_dn_per_s: float | None) -> SceneStatistics:
        """Return the scene as far as one frame resolves it.

        Raises Problem: ``target-unreachable`` where the frame shows no light.
        """
        self._planner.require_possible()
        found = await frame.reconstruction("moments")
        scene, _ = await self._workers.run_long(
            look_of_frame, frame.recipe, found, frame.raw, ambient_dn_per_s
        )
        return scene

    def forget(self) -> None:
        """Drop what was seen, as when the scene is another one."""
        self._cached = None


def look_through(
    planner: Planner,
    twin: CameraTwin,
    base: Sequence,
    ambient_dn_per_s: float | None,
    calibrated_c: float | None,
    progress: Progress,
) -> SceneStatistics:
    """Look at the scene before a camera that is opened for that."""
    with twin.open() as camera:
        return planner.look(
            camera,
            base,
            ambient_dn_per_s=ambient_dn_per_s,
            calibrated_c=calibrated_c,
            progress=progress,
        )
