"""One capture and everything computed of it, each thing once for all who request it.

A product takes two hops to a worker: one computes the stages of the reconstruction that were
requested meanwhile, all in one go, the other makes the array and its bytes. Everything here lives
on the event loop and computes nothing there.
"""

import asyncio
import math
import time
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Coroutine, Hashable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any, Final, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam import Frame as EncodedFrame
from transientcam.documents import FrameDocument
from transientcam_driver import RawFrame, Truth
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging._encodings.encoding import Encoding
from transientcam_server.imaging._errors_of_range.accuracy import (
    RangeAccuracy,
    range_accuracy,
    spacing_px,
)
from transientcam_server.imaging._frames.bands import STREAMED_BYTES, Banded, computed
from transientcam_server.imaging._frames.meta import frame_meta
from transientcam_server.imaging._frames.stages import (
    OF_ESTIMATOR,
    STAGES,
    Computed,
    compute,
    spread_of,
)
from transientcam_server.imaging._frames.workers import Workers
from transientcam_server.imaging._products.products import PRODUCTS, Product
from transientcam_server.imaging._products.view import EVERYTHING, View
from transientcam_server.imaging._recipe.recipe import Recipe

_T = TypeVar("_T")
_Array = NDArray[Any]
_Memory = OrderedDict[Hashable, "asyncio.Future[Any]"]
MAX_ANSWER_BYTES = 512 * 1024 * 1024
"""A product over time with more than this is not computed."""
MAX_WHOLE_BYTES = 24 * 1024 * 1024
"""One that is not sent in bands may have no more than this."""
_REMEMBERED_BYTES: Final = STREAMED_BYTES
_REMEMBERED_TIME_AXES: Final = 2
_REMEMBERED_CROPS: Final = 32
_SAME_NOISE: Final = 1.2


class Frame:
    """One capture and everything computed from it so far.

    Attributes
    ----------
    number
        Counted from 1, never reset.
    raw
        The labelled images.
    recipe
        Sequence, settings and gains that its products are computed with; its noise is that of the
        images, once they are reconstructed, where no sensor is stated.
    previous
        The capture before, where its images may be filled in from it.
    averaged
        Its moments together with those of the frames before, once they are; None where it stands
        alone.
    past
        Whether it is a former or a recorded one, whose computation delays no new one.
    """

    def __init__(
        self,
        workers: Workers,
        number: int,
        raw: RawFrame,
        recipe: Recipe,
        *,
        previous: RawFrame | None = None,
        averaged: "asyncio.Future[tm.Measured | None] | None" = None,
        truth: Callable[[float], Truth] | None = None,
        past: bool = False,
    ) -> None:
        self.number = number
        self.raw = raw
        self.previous = previous
        self.averaged = averaged
        self.recipe = recipe
        self.past = past
        self._workers = workers
        self._run = workers.run_long if past else workers.run
        self._spread = tm.kernels.at_once if past else spread_of(raw)
        self._truth = truth
        self._computed = Computed()
        self._accuracy: RangeAccuracy | None = None
        self._reconstruct_s: float | None = None
        self._stages: dict[str, asyncio.Future[tm.Reconstruction]] = {}
        self._requested: set[str] = set()
        self._computing: asyncio.Task[None] | None = None
        self._whole: _Memory = OrderedDict()
        self._over_time: _Memory = OrderedDict()
        self._crops: _Memory = OrderedDict()

    def bare(self) -> "Frame":
        """Return the same frame with nothing computed: what is kept of one that is history."""
        return Frame(
            self._workers,
            self.number,
            self.raw,
            self.recipe,
            previous=self.previous,
            averaged=None if self.averaged is None else self._workers.start(_alone(self.averaged)),
            truth=self._truth,
            past=True,
        )

    async def noise(self) -> tuple[float | None, str | None]:
        """Return `tm.Reconstruction.noise_ratio`, and in words that it is not 1, if it is not.

        The ratio is None also while nothing is computed.
        """
        found = self._computed.reconstruction
        if found is None:
            return None, None
        ratio, _ = await self._workers.run_long(lambda: found.noise_ratio)
        if ratio is None or 1 / _SAME_NOISE <= ratio <= _SAME_NOISE:
            return ratio, None
        return ratio, f"The images scatter {ratio:.2f} times as much as the stated sensor's would"

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.raw.images.shape[-2:]
        return height, width

    @property
    def size_bytes(self) -> int:
        """What a frame takes in memory of which nothing else is computed."""
        if self.averaged is None:
            return self.raw.size_bytes
        planes = len(self.recipe.applied.sequence.multiples) + 1
        return self.raw.size_bytes + (8 * planes + 4) * math.prod(self.shape)

    @property
    def computing(self) -> bool:
        """Whether stages of its reconstruction are being computed."""
        return self._computing is not None

    @property
    def reconstruct_s(self) -> float:
        """How long its reconstruction was computed so far, in s."""
        return self._reconstruct_s or 0.0

    def meta(self) -> FrameDocument:
        """Return what is known of the frame, as the wire contract has it."""
        return frame_meta(
            self.number, self.raw, self.recipe, self._computed, self._reconstruct_s, self._accuracy
        )

    # -- the first hop: stages of the reconstruction -------------------------------------------

    async def reconstruction(self, stage: str) -> tm.Reconstruction:
        """Return the reconstruction with at least this stage computed (`STAGES`)."""
        future = self._stages.get(stage)
        if future is None:
            future = self._stages[stage] = asyncio.get_running_loop().create_future()
            self._requested.add(stage)
            if self._computing is None:
                self._computing = self._workers.start(self._compute_requested())
        return await _shared(future)

    async def computed(self, products: Iterable[Product]) -> None:
        """Return once all that products follow from is computed, or has failed."""
        inputs = (self._input(product) for product in products)
        await asyncio.gather(*inputs, return_exceptions=True)

    async def truth(self) -> Truth:
        """Return the ground truth of the simulated scene at the time of the capture."""
        return await self._once("truth", self._compute_truth, self._whole)

    async def accuracy(self) -> RangeAccuracy:
        """Return noise and bias of the range; it takes several reconstructions.

        Only for cameras whose sensor is known.
        """
        return await self._once("accuracy", self._compute_accuracy, self._whole)

    async def with_moments(self, compute: Callable[..., _T], *arguments: Any) -> _T:
        """Return what ``compute(recipe, reconstruction, meta, *arguments)`` gives on a worker.

        Raises Problem ``product-failed`` if it raised.
        """
        with self._failure_of("moments"):
            found = await self.reconstruction("moments")
            value, _ = await self._run(compute, self.recipe, found, self.meta(), *arguments)
        return value

    async def _compute_requested(self) -> None:
        """Compute the stages requested in this turn of the loop in one go, then later ones."""
        await asyncio.sleep(0)
        requested: set[str] = set()
        try:
            while self._requested:
                averaged = None if self.averaged is None else await _shared(self.averaged)
                requested, self._requested = self._requested, set()
                run = self._run
                if self.recipe.of_another_package and OF_ESTIMATOR in requested:
                    # it may fail, end or hang: all else goes before it, and new frames beside it
                    self._requested = {OF_ESTIMATOR} if len(requested) > 1 else set()
                    requested -= self._requested
                    run = self._run if self._requested else self._workers.run_long
                with self._workers.one_more_frame() as alone:
                    self._computed, elapsed_s = await run(
                        compute,
                        self._computed,
                        self.recipe,
                        self.raw,
                        self.previous,
                        requested,
                        averaged,
                        # frames at once take a core each, which is less work than sharing all
                        self._spread if alone else tm.kernels.at_once,
                    )
                self.recipe = self.recipe.with_noise_of(self._computed.reconstruction)
                self._reconstruct_s = (self._reconstruct_s or 0.0) + elapsed_s
                for stage in requested:
                    self._settle(self._stages[stage], self._computed, stage)
        finally:
            self._computing = None
            for stage in requested | self._requested:
                self._stages[stage].cancel()  # nothing to those that are done

    @staticmethod
    def _settle(
        future: "asyncio.Future[tm.Reconstruction]", computed: Computed, stage: str
    ) -> None:
        failure = computed.failures.get(stage)
        if failure is not None:
            future.set_exception(failure)
            future.exception()  # retrieved here, or asyncio logs it where no caller is left
        elif computed.reconstruction is not None:
            future.set_result(computed.reconstruction)

    async def _compute_truth(self) -> Truth:
        assert self._truth is not None  # noqa: S101 - other cameras have no product of it
        middle_s = self.raw.device_time_s + 0.5 * self.raw.capture_s
        truth, _ = await self._run(self._truth, middle_s)
        return truth

    async def _compute_accuracy(self) -> RangeAccuracy:
        found = await self.reconstruction("returns")
        # a live frame is late with what takes seconds, and so is all that is sent with it
        every_px = 1 if self.past else spacing_px(self.recipe)
        accuracy, _ = await self._workers.run_long(
            range_accuracy, self.recipe, found, every_px, self.raw
        )
        self._accuracy = accuracy
        return accuracy

    async def _input(self, product: Product) -> Any:
        """Return what a product is computed from."""
        if product.needs in STAGES:
            return await self.reconstruction(product.needs)
        if product.needs == "accuracy":
            return await self.accuracy()
        return self.raw if product.needs == "raw" else await self.truth()

    # -- the second hop: arrays and bytes ------------------------------------------------------

    async def product(self, product: Product, view: View = EVERYTHING) -> _Array:
        """Return a product, whole unless it is one over time; times only for those.

        Raises Problem ``product-failed`` if its computation raised, ``answer-too-large`` if it
        would take more memory than an answer may.
        """
        view = view if product.over_time else EVERYTHING
        array: _Array = await self._once(
            _array_key(product, view),
            lambda: self._compute_product(product, view),
            self._arrays(product),
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
        """Return a product as bytes, encoded once for all who request the same ones.

        Raises Problem as `product`.
        """
        whole = self._whole if view.crop.is_whole else self._crops
        data: bytes = await self._once(
            ("encoded", product.name, view, encoding.name, channel),
            lambda: self._encode(product, encoding, view, channel),
            self._over_time if product.over_time else whole,
        )
        return data

    async def bands(self, planned: Banded) -> AsyncIterator[bytes]:
        """Return the bytes of a product: its head, then each band once the one before was taken.

        They keep what they are computed from, and not the frame: a client may take long.
        Raises Problem as `product`; later, while the bands are computed, ``product-failed``.
        """
        product, view = planned.product, planned.view
        self._require_size(product, view, MAX_ANSWER_BYTES)
        with self._failure_of(product.name):
            found = await self._input(product)
        given = SimpleNamespace(**{name: getattr(found, name) for name in product.reads})
        meta = view.crop.with_meta(self.meta())
        head = planned.head(meta, product.with_fields(self.recipe, self.raw, view))
        failure_of = partial(_failure_of, self._workers, self.number)
        return _banded(planned, head, self.recipe, given, self._workers, failure_of)

    async def _compute_product(self, product: Product, view: View) -> _Array:
        self._require_size(product, view, min(MAX_WHOLE_BYTES, MAX_ANSWER_BYTES))
        with self._failure_of(product.name):
            given = await self._input(product)
            run = self._workers.run_long if product.long else self._run
            height, width = self.shape
            compute = partial(computed, height=height, width=width)
            array, _ = await run(compute, product, self.recipe, given, view)
        return array

    async def _encode(
        self, product: Product, encoding: Encoding, view: View, channel: int | None
    ) -> bytes:
        """Compute and encode in one hop; an array that is there already is only encoded."""
        self._require_size(product, view, min(MAX_WHOLE_BYTES, MAX_ANSWER_BYTES))
        beside = await asyncio.gather(*(self.product(PRODUCTS[name]) for name in encoding.beside))
        run = self._workers.run_long if product.long or encoding.slow else self._run
        with self._failure_of(product.name):
            known = self._arrays(product).get(_array_key(product, view))
            array = None if known is None else await _shared(known)
            given = await self._input(product) if known is None else None
            extra = product.with_fields(self.recipe, self.raw, view)
            framed = partial(
                EncodedFrame,
                product.name,
                product.description.unit,
                product.description.axes,
                view.crop.with_meta(self.meta()),
                channel=channel,
                extra=extra | dict(zip(encoding.beside, beside, strict=True)),
            )
            (array, data), _ = await run(
                _made, product, encoding, self.recipe, self.raw, given, array, view, framed
            )
        self._remember(product, view, array)
        self._workers.note_success(product.name)
        return data

    def _arrays(self, product: Product) -> _Memory:
        return self._over_time if product.over_time else self._whole

    def _remember(self, product: Product, view: View, array: _Array) -> None:
        if product.over_time and array.nbytes > _REMEMBERED_BYTES:
            return
        if product.of_view and not view.crop.is_whole:
            return
        future: asyncio.Future[_Array] = asyncio.get_running_loop().create_future()
        future.set_result(array)
        self._arrays(product).setdefault(_array_key(product, view), future)
        self._forget_oldest()

    async def _once(
        self, key: Hashable, work: Callable[[], Coroutine[Any, Any, _T]], memory: _Memory
    ) -> _T:
        task = memory.get(key)
        if task is None:
            task = memory[key] = self._workers.start(work())
            self._forget_oldest()
        result: _T = await _shared(task)
        if memory is self._over_time and _size(result) > _REMEMBERED_BYTES:
            memory.pop(key, None)
        return result

    def _forget_oldest(self) -> None:
        """Keep few: a frame may stay for long, and times of flight and regions are endless."""
        while len(self._over_time) > 2 * _REMEMBERED_TIME_AXES:
            self._over_time.popitem(last=False)
        while len(self._crops) > _REMEMBERED_CROPS:
            self._crops.popitem(last=False)

    def _failure_of(self, name: str) -> AbstractContextManager[None]:
        return _failure_of(self._workers, self.number, name)

    def _require_size(self, product: Product, view: View, most_bytes: int) -> None:
        if not product.over_time:
            return
        rows, columns = view.crop.shape(*self.shape)
        values = math.prod(product.shape(self.recipe.applied, rows, columns, times=1))
        limit = most_bytes // (4 * values)
        times = len(view.time_s)
        if times > limit:
            raise Problem(
                kinds.ANSWER_TOO_LARGE,
                f"{times} times of flight were requested, but an answer holds at most {limit}.",
                field="time_s",
                value=times,
                limit=f"at most {limit}",
            )


async def _banded(
    planned: Banded,
    head: bytes,
    recipe: Recipe,
    given: SimpleNamespace,
    workers: Workers,
    failure_of: Callable[[str], AbstractContextManager[None]],
) -> AsyncIterator[bytes]:
    product = planned.product
    yield head
    for band in planned.bands:
        with failure_of(product.name):
            array, _ = await workers.run_long(product.compute, recipe, given, band.view)
            data = band.of(array, product.description.dtype)
            del array
        yield data
    workers.note_success(product.name)


@contextmanager
def _failure_of(workers: Workers, number: int, name: str) -> Iterator[None]:
    """Turn what goes wrong with a product into that product's problem alone."""
    try:
        yield
    except Problem:
        raise
    except tm.ParameterError as error:
        # started with another estimator than its sequence allows, or of a recording's sequence
        raise Problem(
            kinds.ESTIMATOR_MISFIT,
            f"There is no {name} of frame {number}: {error}.",
            field=error.field,
            value=error.value,
            limit=error.limit,
        ) from error
    except tm.PluginFailed as error:
        workers.note_failure(name, number)
        raise Problem(
            kinds.PRODUCT_FAILED,
            f"There is no {name} of frame {number}: {error}.",
            product=name,
            frame=number,
        ) from error
    except Exception as error:
        workers.note_failure(name, number)
        raise Problem(
            kinds.PRODUCT_FAILED,
            f"Computing {name} of frame {number} failed.",
            product=name,
            frame=number,
        ) from error


def _size(value: object) -> int:
    return value.nbytes if isinstance(value, np.ndarray) else len(cast("bytes", value))


def _array_key(product: Product, view: View) -> Hashable:
    return "product", product.name, view if product.over_time else EVERYTHING


async def _alone(averaged: "asyncio.Future[tm.Measured | None]") -> tm.Measured | None:
    found = await _shared(averaged)
    return None if found is None else found.average_alone()


async def _shared(future: "asyncio.Future[_T]") -> _T:
    """Wait for what others may wait for too: a caller that stops waiting does not stop it.

    Raises Problem ``shutting-down`` where the workers were closed meanwhile.
    """
    try:
        return future.result() if future.done() else await asyncio.shield(future)
    except asyncio.CancelledError:
        task = asyncio.current_task()
        if future.cancelled() and task is not None and not task.cancelling():
            raise Problem(kinds.SHUTTING_DOWN, "The service is shutting down.") from None
        raise


def _made(
    product: Product,
    encoding: Encoding,
    recipe: Recipe,
    raw: RawFrame,
    given: Any,
    array: _Array | None,
    view: View,
    framed: "partial[EncodedFrame]",
) -> tuple[_Array, bytes]:
    """Return a product, computed where ``array`` is None, and the bytes of what the view shows.

    One that is computed for a view is that view alone; ``array`` is one of all pixels.
    """
    begin_s = time.perf_counter()
    height, width = raw.images.shape[-2:]
    cropped = product.over_time or (array is None and product.of_view)
    if array is None:
        array = computed(product, recipe, given, view, height=height, width=width)
    extra = framed.keywords["extra"]
    if encoding.archive:
        extra |= product.archive(recipe, raw, view)
    shown = array if cropped else view.crop.apply(array, product.description.axes)
    extra |= {name: view.crop.apply(extra[name]) for name in encoding.beside}
    # in the type of the contract, also where the computation worked in another one
    shown = np.asarray(shown, dtype=product.description.dtype, order="C")
    frame = framed(array=shown, encode_s=time.perf_counter() - begin_s, extra=extra)
    return array, encoding.encode(frame)
