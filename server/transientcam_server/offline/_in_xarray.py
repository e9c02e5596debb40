"""A recording as an xarray.Dataset that reads and computes what is indexed; needs xarray."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from transientcam_server.errors import MissingExtra
from transientcam_server.imaging import Product, Recipe, evenly
from transientcam_server.offline._computing import ComputedFrame, known_product
from transientcam_server.offline._images import ByFrame, raw_images
from transientcam_server.recording import Recording, attributes_of, columns_of

try:
    import xarray
    from xarray.backends import BackendArray
    from xarray.core import indexing
except ModuleNotFoundError as error:
    raise MissingExtra("to_xarray", "xarray", "convert") from error


class _Indexed(BackendArray):
    """An array by frames, as xarray indexes those of files."""

    def __init__(self, array: ByFrame) -> None:
        self.shape, self.dtype = array.shape, array.dtype
        self._array = array

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._array.__getitem__
        )


def dataset(
    recording: Recording, frames: Sequence[ComputedFrame], recipe: Recipe, products: Sequence[str]
) -> xarray.Dataset:
    """Return images, labels, series and products of a recording."""
    variables: dict[str, Any] = {
        name: (column.axes, column.values, dict(column.attributes))
        for name, column in columns_of(recording).items()
    }
    axes = ("frame", "image", "y", "x")
    variables["raw"] = _variable(axes, raw_images(recording), "DN", "raw images")
    chosen = [known_product(name) for name in products]
    if any(product.over_time for product in chosen):
        times = evenly(recipe.base_frequency_hz)
        variables["time"] = (("time",), np.asarray(times), {"units": "s"})
    for product in chosen:
        variables[product.name] = _computed(recording, frames, recipe, product)
    return xarray.Dataset(variables, attrs=attributes_of(recording))


def _computed(
    recording: Recording, frames: Sequence[ComputedFrame], recipe: Recipe, product: Product
) -> xarray.Variable:
    times = len(evenly(recipe.base_frequency_hz)) if product.over_time else 0
    count, _, height, width = recording.shape
    shape = product.shape(recipe.applied, height, width, times=times)
    description = product.description
    array = ByFrame(
        (count, *shape), description.dtype, lambda index: frames[index].product(product.name).array
    )
    return _variable(("frame", *description.axes), array, description.unit, description.summary)


def _variable(axes: tuple[str, ...], array: ByFrame, unit: str, says: str) -> xarray.Variable:
    attributes = {"units": unit, "long_name": says}
    return xarray.Variable(axes, indexing.LazilyIndexedArray(_Indexed(array)), attributes)
