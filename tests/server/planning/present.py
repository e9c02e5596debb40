"""The scene before a camera, of which looks and fronts are asked for."""

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from transientcam_driver import Capabilities, Sequence, SubPhases
from transientcam_server.imaging import Frame, Workers
from transientcam_server.planning import (
    FrontCache,
    Goal,
    Looks,
    Planner,
    PlanningQueue,
    Progress,
    front_goal,
)

BASE = Sequence(harmonics=3, takes=2, sub_phases=SubPhases("none"))


class Queue:
    """Computes nothing; what it is asked for gets numbers."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []

    async def run(self, _: object, *arguments: object, progress: Progress) -> Any:
        self.asked.append(arguments)
        progress.show({"part": len(self.asked)})
        await asyncio.sleep(0)
        return {"answer": len(self.asked)}


class Threads:
    """Computes at once."""

    async def run(self, compute: Callable[..., Any], *arguments: object) -> Any:
        return compute(*arguments), 0.0

    async def run_long(self, compute: Callable[..., Any], *arguments: object) -> Any:
        return compute(*arguments), 0.0


class Bench:
    """Looks and fronts of one camera, with a clock that the test moves."""

    def __init__(self, *, twin: bool = True, simulated: bool = True) -> None:
        self.now_s = 100.0
        self.queue = Queue()
        planner = cast(
            Planner,
            SimpleNamespace(require_possible=lambda: None, tradeoff_document=lambda *_: None),
        )
        workers, queue = cast(Workers, Threads()), cast(PlanningQueue, self.queue)
        opened = cast(Any, (lambda: "twin") if twin else None)
        self.looks = Looks(planner, workers, queue, opened, clock=lambda: self.now_s)
        self.fronts = FrontCache(
            planner, workers, queue, self.looks, simulated=simulated, clock=lambda: self.now_s
        )

    async def looked(self, base: Sequence = BASE, ambient: float | None = None) -> Any:
        return await self.looks.of_twin(base, ambient, Progress())

    async def front(self, frame: Frame, by: str = "range_error_m") -> dict[str, Any]:
        return await self.fronts.of(frame, front_goal(by), Progress(), Progress())

    @property
    def goals(self) -> list[tuple[Goal, Any]]:
        """Goals of the fronts that were computed, and the scenes they are for."""
        return [asked for asked in self.queue.asked if isinstance(asked[0], Goal)]


def frame(number: int, capabilities: Capabilities, *, epoch: int = 1, version: int = 1) -> Frame:
    async def nothing(*_: object) -> None: ...

    async def found(_: str) -> object:
        return SimpleNamespace(range_m=np.array([1.5, 2.5, np.nan]))

    async def truth() -> object:
        return SimpleNamespace(range_m=np.array([1.0, 2.5, 3.0]), lit=np.ones(3, dtype=bool))

    recipe = SimpleNamespace(applied=capabilities.apply(BASE), settings_version=version)
    made = SimpleNamespace(
        number=number,
        raw=SimpleNamespace(epoch=epoch),
        recipe=recipe,
        reconstruction=found,
        accuracy=nothing,
        truth=truth,
        meta=lambda: {"frame": number},
    )
    return cast(Frame, made)
