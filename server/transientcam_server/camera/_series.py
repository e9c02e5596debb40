"""A series: so many frames at each of several settings, and how far their ranges are off."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Sequence as List
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Camera, FrameTimeout, RawFrame, Sequence
from transientcam_server.camera._acquisition import READ_TIMEOUT_S, Acquisition
from transientcam_server.camera._jobs import Job, Jobs
from transientcam_server.imaging import PRODUCTS, Pipeline, Recipe
from transientcam_server.settings import ReconstructionSettings

MAX_VALUES: Final = 2**25
"""Ranges of one setting, which are kept until they are compared: less than 1.5 GB with truth."""
_AT_ONCE: Final = 4
"""Frames that are computed; those that come meanwhile are left out."""
_Array = NDArray[Any]
_Computed = tuple[_Array, _Array | None, Recipe]
"""Ranges (P) of the pixels of a frame that count, their truth where it is known, and what they were
computed with."""
_OF_SEQUENCE: Final = (
    *("harmonics", "base_frequency_hz", "exposure_s", "takes"),
    *("capture_s", "frame_rate_hz"),
)
_FIGURES: Final = (
    *("reference", "range_std_m", "range_std_p90_m"),
    *("range_bias_m", "range_bias_abs_m", "within_share"),
)


def start_series(
    settings: List[tuple[Sequence, ReconstructionSettings]],
    *,
    frames: int,
    pixels: _Array,
    target_m: float | None,
    acquisition: Acquisition,
    pipeline: Pipeline,
    jobs: Jobs,
    offs: int,
) -> Job:
    """Start capturing ``frames`` at each setting; the job's result has a row of each, in ``rows``.

    ``pixels`` (H, W) says which count; ``target_m``: how close a range is to be; ``offs`` is as
    `Acquisition.occupy` has it. Frames are computed as they come, each by itself.

    Raises Problem ``camera-busy``, ``too-many-jobs``.
    """
    acquisition.require_free()

    async def computed(raw: RawFrame, recipe: Recipe) -> _Computed:
        frame = pipeline.recorded_frame(raw.number, raw, recipe)
        range_m = await frame.product(PRODUCTS["range"])
        truth_m = (await frame.truth()).range_m[pixels] if "truth" in pipeline.products else None
        return range_m[pixels], truth_m, frame.recipe  # copies: a frame's other pixels go

    async def work(job: Job) -> dict[str, Any]:
        loop, rows = asyncio.get_running_loop(), list[dict[str, Any]]()

        def captured(camera: Camera, go_on: Callable[[], None], recipe: Recipe) -> list[_Computed]:
            found, waiting = list[_Computed](), deque[Any]()
            go_on()  # the light may have been switched off meanwhile
            camera.start()
            try:
                while len(found) < frames:
                    done = (len(rows) + len(found) / frames) / len(settings)
                    job.report(done, f"setting {len(rows) + 1} of {len(settings)}")
                    go_on()
                    while waiting and waiting[0].done():
                        found.append(waiting.popleft().result())
                    with suppress(FrameTimeout):
                        raw = camera.read_frame(timeout_s=READ_TIMEOUT_S)
                        if len(waiting) < min(_AT_ONCE, frames - len(found)):
                            computing = computed(raw, recipe)
                            waiting.append(asyncio.run_coroutine_threadsafe(computing, loop))
            finally:
                camera.stop()
            return found

        def capture(camera: Camera, go_on: Callable[[], None]) -> None:
            for sequence, reconstruction in settings:
                begun_s, applied = time.monotonic(), camera.configure(sequence)
                recipe = replace(pipeline.recipe_of(applied), settings=reconstruction)
                found, document = captured(camera, go_on, recipe), applied.to_document()
                row = {name: document[name] for name in _OF_SEQUENCE}
                row |= {"estimator": recipe.technique, "neighbours": reconstruction.neighbours}
                row |= {"frames": frames, "took_s": time.monotonic() - begun_s}
                rows.append(row | measured(found, pixels, target_m))
                job.show({"target_m": target_m, "rows": list(rows)})

        await asyncio.wrap_future(acquisition.occupy(job.id, capture, offs=offs))
        return {"target_m": target_m, "rows": rows}

    return jobs.start("series", work)


def measured(found: List[_Computed], pixels: _Array, target_m: float | None) -> dict[str, Any]:
    """Return how far ranges of frames scatter, and are off truth or plane, as a row has it."""
    _, truth_m, recipe = found[0]
    ranges_m = np.array([range_m for range_m, _, _ in found])
    has = np.isfinite(ranges_m)
    seen = pixels.copy()
    seen[pixels] = has.sum(axis=0) > 1
    row: dict[str, Any] = {"valid_share": float(has.mean()), "pixels": int(seen.sum())}
    if not seen.any():
        return row | dict.fromkeys(_FIGURES)
    there = seen[pixels]
    ranges_m = ranges_m[:, there].astype(float)
    if truth_m is not None:
        right_m = np.array([each[there] for _, each, _ in found if each is not None])
    else:
        image_m = np.zeros(pixels.shape)
        image_m[seen] = np.nanmean(ranges_m, axis=0)
        right_m = image_m[seen] - _off_plane_m(recipe.lens(*pixels.shape).points(image_m)[:, seen])
    off_m = ranges_m - right_m
    std_m, bias_m = np.nanstd(ranges_m, axis=0, ddof=1), np.nanmean(off_m, axis=0)
    figures = np.median(std_m), np.quantile(std_m, 0.9), np.median(bias_m), np.median(abs(bias_m))
    within = None if target_m is None else float((np.abs(off_m) <= target_m).sum() / has.size)
    reference = "plane" if truth_m is None else "truth"
    return row | dict(zip(_FIGURES, [reference, *map(float, figures), within], strict=True))


def _off_plane_m(points_m: _Array) -> _Array:
    """Return how far behind the plane that fits best points (3, N) are, along their rays."""
    distance_m = np.linalg.norm(points_m, axis=0)
    rays = points_m / distance_m
    # ray . q = 1 / distance for the plane q . x = 1, weighted so that errors of the distance count
    q = np.linalg.lstsq((rays * distance_m**2).T, distance_m, rcond=None)[0]
    behind_m: _Array = distance_m - 1.0 / (q @ rays)
    return behind_m
