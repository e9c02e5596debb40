"""The scene before the daemon's camera, as plans see it; kept for ten seconds."""

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from typing import Any, Final, Protocol

from transientcam_driver import Camera, FrameTimeout, RawFrame, Sequence
from transientcam_server.imaging import Frame, Recipe, Workers
from transientcam_server.planning._planner import Planner
from transientcam_server.planning._process.queue import PlanningQueue, Progress
from transientcam_server.planning._scene.look import look_of_frame
from transientcam_server.planning._scene.scene import SceneStatistics

CACHED_S: Final = 10.0
_ASK_EVERY_S: Final = 0.1


class CameraTwin(Protocol):
    """A simulated camera before the same scene, in virtual time; it is pickled."""

    def open(self) -> AbstractContextManager[Camera]:
        """Open it."""
        ...


class Looks:
    """Looks at the present scene; on the event loop, computed elsewhere.

    A simulated camera has a twin that looks in its place, so that frames go on undisturbed and no
    busy machine loses images. Any other camera looks by itself, without frames for some seconds;
    or the current frame has to be enough.
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

    async def of_camera(
        self,
        occupy: Callable[..., "Future[Any]"],
        recipe: Recipe,
        ambient_dn_per_s: float | None,
        progress: Progress,
    ) -> SceneStatistics:
        """Return the scene by the camera itself, lent as `Acquisition.occupy` does.

        ``recipe``: Of its frames, with the gains that fit their sequence.
        """
        how: dict[str, Any]
        how = {"ambient_dn_per_s": ambient_dn_per_s, "calibrated_c": self._calibrated_c()}
        how |= {"in_use": recipe.gains, "progress": progress}

        def captured(camera: Camera, go_on: Callable[[], None]) -> Callable[[], SceneStatistics]:
            asking: Any = _Asking(camera, go_on)
            return self._planner.capture_look(asking, recipe.applied.sequence, **how)

        described = await asyncio.wrap_future(occupy(captured))
        scene: SceneStatistics
        scene, _ = await self._workers.run_long(described)
        return scene

    def forget(self) -> None:
        """Drop what was seen, as when the scene is another one."""
        self._cached = None


class _Asking:
    """A camera that asks whether to go on while it waits for a frame."""

    def __init__(self, camera: Camera, go_on: Callable[[], None]) -> None:
        self._camera, self._go_on = camera, go_on

    def __getattr__(self, name: str) -> Any:
        return getattr(self._camera, name)

    def read_frame(self, *, timeout_s: float) -> RawFrame:
        """Return the next frame, as the camera does."""
        until_s = time.monotonic() + timeout_s
        while True:
            self._go_on()
            try:
                return self._camera.read_frame(timeout_s=_ASK_EVERY_S)
            except FrameTimeout:
                if time.monotonic() > until_s:
                    raise


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
