"""The Pareto front of the scene before the camera, kept for ten seconds."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from transientcam_driver import AppliedSequence, Sequence
from transientcam_server.imaging import Frame, Workers
from transientcam_server.planning._looks import CACHED_S, Looks
from transientcam_server.planning._planner import Planner, range_error
from transientcam_server.planning._process.queue import PlanningQueue, Progress
from transientcam_server.planning._search.families import Goal

_WIDE: Final = 1e9  # a target that every sequence reaches: it only requests the prediction
_KEPT: Final = 8


def front_goal(by: str, share: float | None = None, **more: Any) -> Goal:
    """Return the goal that a front is compared by: all sequences reach it."""
    target: dict[str, Any] = {} if by == "range_error_m" else {by: _WIDE}
    return Goal(share=share, **more, **target)


@dataclass(frozen=True, slots=True)
class _CachedFront:
    made_with: tuple[int, int]
    frame: int
    until_s: float
    document: dict[str, Any]


class FrontCache:
    """Pareto fronts of the present scene; on the event loop, computed elsewhere."""

    def __init__(
        self,
        planner: Planner,
        workers: Workers,
        queue: PlanningQueue,
        looks: Looks,
        *,
        simulated: bool,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._planner = planner
        self._workers = workers
        self._queue = queue
        self._looks = looks
        self._simulated = simulated
        self._clock = clock
        self._cached: dict[Goal, _CachedFront] = {}
        self._predicting = asyncio.Lock()

    async def of(
        self, frame: Frame, goal: Goal, looking: Progress, predicting: Progress
    ) -> dict[str, Any]:
        """Return the front that is wanted, and the frame's own place, as JSON.

        ``predicting`` shows the same document with the front so far; what either progress raises
        ends the work, unless it is done.
        """
        around = {
            "compared_by": goal.leading,
            "scene_of_frame": frame.number,
            "current": await self._current(frame),
        }
        shown = predicting.part(0.0, 1.0, show=lambda part: predicting.show(around | part))
        async with self._predicting:
            cached = self._cached.get(goal)
            made_with = frame.raw.epoch, frame.recipe.settings_version
            if cached is None or cached.made_with != made_with or self._clock() > cached.until_s:
                document = await self._predicted(frame, goal, looking, shown)
                cached = _CachedFront(made_with, frame.number, self._clock() + CACHED_S, document)
                if len(self._cached) >= _KEPT:
                    self._cached.clear()
                self._cached[goal] = cached
        return around | {"scene_of_frame": cached.frame} | cached.document

    def forget(self) -> None:
        """Drop the fronts, as when the scene is another one."""
        self._cached.clear()
        self._looks.forget()

    async def _predicted(
        self, frame: Frame, goal: Goal, looking: Progress, predicting: Progress
    ) -> dict[str, Any]:
        base = frame.recipe.applied.sequence
        if self._looks.needs_frame:
            scene = await self._looks.of_frame(frame, None)
        else:
            base = Sequence(base_frequency_hz=base.base_frequency_hz, sub_phases=base.sub_phases)
            scene = await self._looks.of_twin(base, None, looking)
        goal = replace(goal, base=base)
        return await self._queue.run(
            self._planner.tradeoff_document, goal, scene, progress=predicting
        )

    async def _current(self, frame: Frame) -> dict[str, Any]:
        found = await frame.reconstruction("returns")
        await frame.accuracy()  # for its metadata
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
