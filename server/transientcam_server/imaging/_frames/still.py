"""Averages of what stands still: each frame after the one before, whoever asks for either.

Everything here lives on the event loop and computes nothing there.
"""

import asyncio
import logging
from typing import Final

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_server.imaging._frames.workers import Workers
from transientcam_server.imaging._recipe.recipe import Recipe

_log = logging.getLogger("transientcam_server.imaging.still")
MOST_WAITING: Final = 8
"""Frames whose averages are due; one more stands alone, and the next begins anew."""


class StillFrames:
    """Averages the frames of a camera in the order of their capture.

    A frame begins anew where it does not follow the one before: after another recipe, a gap in the
    frames' numbers or lost images, and where averaging does not keep up.
    """

    def __init__(self, workers: Workers) -> None:
        self._workers = workers
        self._last: tuple[RawFrame, Recipe, asyncio.Task[tm.Measured | None]] | None = None
        self._waiting = 0

    def following(
        self, raw: RawFrame, recipe: Recipe, previous: RawFrame | None
    ) -> "asyncio.Task[tm.Measured | None] | None":
        """Return the average up to a frame, as it will be; None where it stands alone."""
        last, self._last = self._last, None
        if recipe.settings.still_frames == 1 or self._waiting >= MOST_WAITING:
            return None
        before = None
        if last is not None and last[1] is recipe and not raw.lost_images:
            follows = (raw.epoch, raw.number) == (last[0].epoch, last[0].number + 1)
            before = last[2] if follows else None
        self._waiting += 1
        task = self._workers.start(self._average(raw, recipe, previous, before))
        self._last = raw, recipe, task
        return task

    async def _average(
        self,
        raw: RawFrame,
        recipe: Recipe,
        previous: RawFrame | None,
        before: "asyncio.Task[tm.Measured | None] | None",
    ) -> tm.Measured | None:
        try:
            measured = None if before is None else await asyncio.shield(before)
            return (await self._workers.run(recipe.average, raw, previous, measured))[0]
        except Exception:
            _log.exception("capture %d: averaging it with those before failed", raw.number)
            return None
        finally:
            self._waiting -= 1
