"""One recorded frame and what is computed of it, each stage once, with the daemon's arithmetic."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam import Frame as ProductFrame
from transientcam.documents import FrameDocument
from transientcam.errors import ParameterError
from transientcam_driver import RawFrame
from transientcam_server.imaging import (
    DEFAULT_BINS,
    FIRST,
    PRODUCTS,
    Computed,
    Crop,
    Product,
    Recipe,
    View,
    compute,
    evenly,
    frame_meta,
    product_names,
    product_of,
    unmet,
)

KNOWN: Final = tuple(
    name
    for name, product in PRODUCTS.items()
    # there is no truth of a recording, and no sensor whose noise is known
    if product.needs != "truth" and not product.of_noise
)
"""Our products that recorded frames have."""


def known_products() -> tuple[str, ...]:
    """Return the names of all products that recorded frames have."""
    return (*KNOWN, *(name for name in product_names() if name not in PRODUCTS))


class ComputedFrame:
    """A frame of a recording; see `transientcam.RecordedFrame`.

    ``index``: counted from 0.
    ``recipe``: what it is computed with.
    ``read``: returns the images of a frame by its index.
    """

    def __init__(self, index: int, recipe: Recipe, read: Callable[[int], RawFrame]) -> None:
        self.index = index
        self.recipe = recipe
        self._read = read
        self._computed = Computed()

    @cached_property
    def raw_frame(self) -> RawFrame:
        """Its images with their labels and times."""
        return self._read(self.index)

    @cached_property
    def _previous(self) -> RawFrame | None:
        """The frame before, where images may be filled in from it."""
        return self._read(self.index - 1) if self.recipe.fills and self.index else None

    @property
    def number(self) -> int:
        """Its number, from 1, as over HTTP, in metadata and along the axis ``frame``."""
        return self.index + 1

    @property
    def raw(self) -> NDArray[np.uint16]:
        """Its images (N, H, W) in DN."""
        return self.raw_frame.images

    @property
    def range_m(self) -> NDArray[np.float32]:
        """The product ``range`` (H, W) in m."""
        return self.product("range").array

    @property
    def reconstruction(self) -> tm.Reconstruction:
        """All that follows from its moments."""
        return self._found(FIRST)

    @property
    def meta(self) -> FrameDocument:
        """Its metadata, as the daemon's frames have them."""
        return frame_meta(self.number, self.raw_frame, self.recipe, self._computed, None)

    def product(
        self,
        name: str,
        *,
        time_s: Sequence[float] | None = None,
        bins: int | None = None,
        y: int | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
    ) -> ProductFrame:
        """Return a product with unit, axes and metadata; parameters as of `Camera.frame`.

        Raises ParameterError if there is no such product, not of these frequencies, or without
        times or rows; Problem if region or decimation do not fit; MomentsError if the estimator
        cannot work with this sequence.
        """
        product = known_product(name)
        sequence = self.recipe.applied.sequence
        reason = unmet(product, sequence.sampling, {sequence.zeroth})
        if reason is not None:
            raise ParameterError("name", name, f"another product: {reason}")
        view = self._view(product, time_s, bins, y, region, decimation)
        given = self.raw_frame if product.needs == "raw" else self._found(product.needs)
        array = product.compute(self.recipe, given, view)
        if not product.cropped:
            array = view.crop.apply(array, product.description.axes)
        return ProductFrame(
            product.name,
            product.description.unit,
            product.description.axes,
            view.crop.with_meta(self.meta),
            np.asarray(array, dtype=product.description.dtype, order="C"),
            extra=product.with_fields(self.recipe, self.raw_frame, view),
        )

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_") or name not in known_products():
            known = ", ".join(known_products())
            raise AttributeError(f"a recorded frame has no {name!r}; products: {known}")
        return self.product(name).array

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *known_products()})

    def __repr__(self) -> str:
        images, height, width = self.raw.shape
        return f"<RecordedFrame {self.number}: {images} images of {width} x {height} pixels>"

    def _repr_html_(self) -> str:
        """Return the map of its range, for notebooks."""
        return self.product("range")._repr_html_()

    def _found(self, stage: str) -> tm.Reconstruction:
        computed = compute(self._computed, self.recipe, self.raw_frame, self._previous, {stage})
        if stage in computed.failures:
            raise computed.failures[stage]
        self._computed = computed
        assert computed.reconstruction is not None  # noqa: S101 - nothing failed
        return computed.reconstruction

    def _view(
        self,
        product: Product,
        time_s: Sequence[float] | None,
        bins: int | None,
        y: int | None,
        region: Sequence[int] | None,
        decimation: int | None,
    ) -> View:
        height, width = self.raw.shape[1:]
        crop = Crop.of(region, decimation, height=height, width=width)
        for field, value in (("time_s", time_s), ("bins", bins)):
            if value is not None and not product.over_time:
                raise ParameterError(field, value, f"left out: {product.name} has no such axis")
        if y is not None and not (product.of_row and 0 <= y < height):
            raise ParameterError("y", y, f"a row of a streak, 0 to {height - 1}")
        times: tuple[float, ...] = ()
        if product.over_time and time_s is not None:
            times = tuple(np.asarray(time_s, dtype=float).ravel().tolist())
        elif product.over_time:
            times = evenly(self.recipe.base_frequency_hz, bins or DEFAULT_BINS)
        return View(times, crop, y)


def known_product(name: str) -> Product:
    """Return a product that recorded frames have, or raise a ParameterError."""
    if name not in (known := known_products()):
        raise ParameterError("product", name, f"one of {', '.join(known)}")
    return product_of(name)
