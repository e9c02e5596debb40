"""The Pareto front of the scene before the camera, kept for ten seconds."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from transientcam_driver import AppliedSequence
from transientcam_server.imaging.frame import Frame
from transientcam_server.imaging.workers import Workers
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.planner import Planner, range_error

KEPT_S: Final = 10.0
_WIDE_BOUNDS: Final = 1e9  # a target that every sequence reaches: it only requests the prediction


@dataclass(frozen=True, slots=True)
class _CachedFront:
    made_with: tuple[int, int]
    frame: int
    until_s: float
    choices: list[dict[str, Any]]


class FrontCache:
    """Pareto fronts of the present scene; on the event loop, computed on workers."""

    def __init__(
        self,
        planner: Planner,
        workers: Workers,
        *,
        simulated: bool,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._planner = planner
        self._workers = workers
        self._simulated = simulated
        self._clock = clock
        self._cached: dict[str, _CachedFront] = {}
        self._predicting = asyncio.Lock()

    async def of(self, frame: Frame, by: str) -> dict[str, Any]:
        """Return the front compared by target ``by``, and the frame's own place, as JSON."""
        async with self._predicting:
            cached = self._cached.get(by)
            made_with = frame.raw.epoch, frame.recipe.settings_version
            if cached is None or cached.made_with != made_with or self._clock() > cached.until_s:
                choices = await self._predicted(frame, by)
                cached = _CachedFront(made_with, frame.number, self._clock() + KEPT_S, choices)
                self._cached[by] = cached
        return {
            "compared_by": by,
            "scene_of_frame": cached.frame,
            "current": await self._current(frame),
            "front": cached.choices,
        }

    def forget(self) -> None:
        """Drop the fronts, as when the scene is another one."""
        self._cached.clear()

    async def _predicted(self, frame: Frame, by: str) -> list[dict[str, Any]]:
        found = await frame.reconstruction("returns")
        scene, _ = await self._workers.run(self._planner.scene_statistics, frame.recipe, found, 0.0)
        goal = Goal(
            base=frame.recipe.applied.sequence,
            bound_width=_WIDE_BOUNDS if by == "bound_width" else None,
        )
        choices, _ = await self._workers.run_long(self._planner.front_documents, goal, scene)
        return choices

    async def _current(self, frame: Frame) -> dict[str, Any]:
        found = await frame.reconstruction("returns")
        applied: AppliedSequence = frame.recipe.applied
        error = None
        if self._simulated:
            truth = await frame.truth()
            error, _ = await self._workers.run(range_error, found, truth)
        return {
            "meta": frame.meta(),
            "sequence": applied.sequence.to_document(),
            "capture_s": applied.capture_s,
            "frame_rate_hz": applied.frame_rate_hz,
            "range_error_m": error,
        }
