"""One capture and everything computed of it, each thing once for all who ask.

A `Frame` remembers every stage, product and encoding as a task: the first who asks starts it, all
others wait for the same one. Everything here lives on the event loop and computes nothing there.
"""

import asyncio
import logging
import math
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeVar

from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.calibration import calibration_id
from transientcam_server.imaging.encodings.encoding import Encoding
from transientcam_server.imaging.products import BOUNDS_RADIUS, STAGES, Product, pixel_counts
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.imaging.view import EVERYTHING, View

if TYPE_CHECKING:  # it makes frames
    from transientcam_server.imaging.pipeline import Pipeline

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
_Array = NDArray[Any]
MAX_ANSWER_BYTES = 512 * 1024 * 1024
"""A product over time with more than this is not computed."""
_REMEMBERED_TIME_AXES = 2
_REMEMBERED_CROPS = 32


class Frame:
    """One capture and everything computed from it so far.

    Attributes
    ----------
    number
        Counted from 1, never reset.
    raw
        The labelled images.
    recipe
        Sequence and settings that its products are computed with.
    past
        Whether it is a former or a recorded one, whose computation delays no new one.
    """

    def __init__(
        self,
        pipeline: "Pipeline",
        number: int,
        raw: RawFrame,
        recipe: Recipe,
        *,
        past: bool = False,
    ) -> None:
        self.number = number
        self.raw = raw
        self.recipe = recipe
        self.past = past
        self._pipeline = pipeline
        self._run = pipeline.run_long if past else pipeline.run
        self._reconstruct_s: float | None = None
        self._pixels: dict[str, int] | None = None
        self._rejected_images: int | None = None
        self._deviation: dict[str, float] | None = None
        self._known: dict[Hashable, asyncio.Task[Any]] = {}
        self._over_time: OrderedDict[Hashable, asyncio.Task[Any]] = OrderedDict()
        self._crops: OrderedDict[Hashable, asyncio.Task[Any]] = OrderedDict()

    def bare(self) -> "Frame":
        """Return the same frame with nothing computed: what is kept of one that is history."""
        return Frame(self._pipeline, self.number, self.raw, self.recipe, past=True)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.raw.images.shape[-2:]
        return height, width

    def meta(self) -> dict[str, Any]:
        """Return what is known of the frame, as the wire contract has it."""
        sequence = self.recipe.applied.sequence
        height, width = self.shape
        return {
            "frame": self.number,
            "sequence_id": self.raw.epoch,
            "calibration_id": calibration_id(self.recipe.calibration),
            "reconstruction_id": self.recipe.reconstruction_id,
            "device_time_s": self.raw.device_time_s,
            "host_time_s": self.raw.host_time_s,
            "capture_s": self.raw.capture_s,
            "reconstruct_s": self._reconstruct_s,
            "base_frequency_hz": sequence.base_frequency_hz,
            "harmonics": sequence.harmonics,
            "zeroth": sequence.zeroth,
            "exposure_s": sequence.exposure_s,
            "takes": sequence.takes,
            "width": width,
            "height": height,
            "temperature_c": self.raw.temperature_c,
            "lost_images": self.raw.lost_images,
            "rejected_images": self._rejected_images,
            "pixels": self._pixels,
            "predicted_range_std_m": self._deviation,
        }

    async def stage(self, name: str) -> Any:
        """Return an intermediate result."""
        return await self._once(("stage", name), lambda: self._compute_stage(name), self._known)

    async def product(self, product: Product, view: View = EVERYTHING) -> _Array:
        """Return a product, whole unless it is one over time; times only for those.

        Raises
        ------
        Problem
            ``product-failed`` if its computation raised, ``answer-too-large`` if nobody would
            want to wait for it.
        """
        view = view if product.over_time else EVERYTHING
        array: _Array = await self._once(
            ("product", product.name, view),
            lambda: self._compute_product(product, view),
            self._over_time if product.over_time else self._known,
        )
        return array

    async def encoded(
        self,
        product: Product,
        encoding: Encoding,
        view: View = EVERYTHING,
        *,
        channel: int | None = None,
    ) -> bytes:
        """Return a product as bytes, encoded once for all who ask for the same ones."""
        whole = self._known if view.crop.is_whole else self._crops
        data: bytes = await self._once(
            ("encoded", product.name, view, encoding.name, channel),
            lambda: self._encode(product, encoding, view, channel),
            self._over_time if product.over_time else whole,
        )
        return data

    async def with_moments(self, compute: Callable[..., _T], *arguments: Any) -> _T:
        """Return what ``compute(recipe, moments, meta, *arguments)`` gives on a worker.

        Raises
        ------
        Problem
            ``product-failed`` if it raised.
        """
        with self._failure_of("moments"):
            moments = await self.stage("moments")
            value, _ = await self._run(compute, self.recipe, moments, self.meta(), *arguments)
        return value

    async def _once(
        self,
        key: Hashable,
        work: Callable[[], Coroutine[Any, Any, _T]],
        known: dict[Hashable, asyncio.Task[Any]],
    ) -> _T:
        task = known.get(key)
        if task is None:
            task = known[key] = self._pipeline.start(work())
            # a frame may stay for long; times of flight and regions are endless
            while len(self._over_time) > 2 * _REMEMBERED_TIME_AXES:
                self._over_time.popitem(last=False)
            while len(self._crops) > _REMEMBERED_CROPS:
                self._crops.popitem(last=False)
        # one who stops waiting must not stop it for the others; most find it done
        result: _T = task.result() if task.done() else await asyncio.shield(task)
        return result

    async def _compute_stage(self, name: str) -> Any:
        if name == "raw":
            return self.raw
        if name == "truth":
            result, _ = await self._run(self._pipeline.truth, self._middle_s())
            return result
        stage = STAGES[name]
        needs = await asyncio.gather(*map(self.stage, stage.needs))
        result, elapsed_s = await self._run(stage.compute, self.recipe, *needs)
        self._reconstruct_s = (self._reconstruct_s or 0.0) + elapsed_s
        if name == "moments":
            self._pixels, _ = await self._run(pixel_counts, result)
            self._rejected_images = result.rejected_images
        if name == "returns":
            self._deviation = await self._judged(result)
        return result

    def _middle_s(self) -> float | None:
        """Return when a former frame was captured; of the newest, now is near enough."""
        return self.raw.device_time_s + 0.5 * self.raw.capture_s if self.past else None

    async def _judged(self, found: Any) -> dict[str, float] | None:
        """Return the predicted deviation of the range; a failure of that spoils no range."""
        if self._pipeline.judge is None:
            return None
        try:
            deviation, _ = await self._run(self._pipeline.judge, self.recipe, found)
        except Exception:
            _log.exception("frame %d: predicting the range's deviation failed", self.number)
            return None
        return deviation

    async def _compute_product(self, product: Product, view: View) -> _Array:
        if product.over_time:
            self._refuse_too_large(product, view)
        with self._failure_of(product.name):
            needs = await asyncio.gather(*map(self.stage, product.needs))
            if product.over_time:
                work = self._pipeline.run_long(product.compute, self.recipe, view, *needs)
            else:
                work = self._run(product.compute, self.recipe, *needs)
            array, _ = await work
        return array

    async def _encode(
        self, product: Product, encoding: Encoding, view: View, channel: int | None
    ) -> bytes:
        beside = (self.product(self._pipeline.product(name)) for name in encoding.beside)
        array, *others = await asyncio.gather(self.product(product, view), *beside)
        long = product.over_time or encoding.slow
        run = self._pipeline.run_long if long else self._run
        meta = self.meta() | view.crop.to_meta(*self.shape)
        extra = self._extra(product, view) | dict(zip(encoding.beside, others, strict=True))
        with self._failure_of(product.name):
            data, _ = await run(_written, encoding, product, view, array, meta, extra, channel)
        self._pipeline.note_success(product.name)
        return data

    @contextmanager
    def _failure_of(self, name: str) -> Iterator[None]:
        """Around the making of a product: what goes wrong is that product's problem alone."""
        try:
            yield
        except Problem:
            raise
        except tm.ParameterError as error:
            # started with another estimator than its sequence allows, or of a recording's sequence
            raise Problem(
                kinds.ESTIMATOR_MISFIT,
                f"There is no {name} of frame {self.number}: {error}.",
                field=error.field,
                value=error.value,
                limit=error.limit,
            ) from error
        except Exception as error:
            self._pipeline.note_failure(name, self.number)
            raise Problem(
                kinds.PRODUCT_FAILED,
                f"Computing {name} of frame {self.number} failed.",
                product=name,
                frame=self.number,
            ) from error

    def _extra(self, product: Product, view: View) -> dict[str, Any]:
        """Return what only this product's messages hold."""
        extra: dict[str, Any] = {"time_s": list(view.time_s)} if product.over_time else {}
        match product.name:
            case "raw":
                extra["labels"] = [asdict(label) for label in self.raw.labels]
            case "streak":
                extra["y"] = view.y
            case "bounds":
                extra["radius"] = BOUNDS_RADIUS
            case "pointcloud":
                extra["intrinsics"] = asdict(self.recipe.lens(*self.shape))
        return extra

    def _refuse_too_large(self, product: Product, view: View) -> None:
        rows, columns = view.crop.shape(*self.shape)
        values = math.prod(product.shape(self.recipe.applied, rows, columns, times=1))
        limit = MAX_ANSWER_BYTES // (4 * values)
        times = len(view.time_s)
        if times > limit:
            raise Problem(
                kinds.ANSWER_TOO_LARGE,
                f"{times} times of flight were asked for, but an answer holds at most {limit}.",
                field="time_s",
                value=times,
                limit=f"at most {limit}",
            )


def _written(
    encoding: Encoding,
    product: Product,
    view: View,
    array: _Array,
    meta: dict[str, Any],
    extra: dict[str, Any],
    channel: int | None,
) -> bytes:
    """Cut a product, and those beside it, to what is wanted of them, and encode it."""
    if not product.over_time:  # those were computed for no more than that
        array = view.crop.apply(array, product.description.axes)
        extra |= {name: view.crop.apply(extra[name]) for name in encoding.beside}
    return encoding.encode(product, array, meta, extra, channel)
