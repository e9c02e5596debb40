"""A recording as an xarray.Dataset that reads and computes what is indexed; needs xarray."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from transientcam_server.errors.exceptions import MissingExtra
from transientcam_server.imaging.products import Product
from transientcam_server.imaging.view import evenly
from transientcam_server.offline.computing import known_product
from transientcam_server.offline.images import ByFrame
from transientcam_server.recording.columns import attributes_of, columns_of
from transientcam_server.recording.reader import Recording

try:
    import xarray
    from xarray.backends import BackendArray
    from xarray.core import indexing
except ModuleNotFoundError as error:
    raise MissingExtra("to_xarray", "xarray", "convert") from error

if TYPE_CHECKING:
    from transientcam_server.offline.opening import OpenedRecording


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
    opened: "OpenedRecording", recording: Recording, products: Sequence[str]
) -> xarray.Dataset:
    """Return images, labels, series and products of a recording."""
    variables: dict[str, Any] = {
        name: (column.axes, column.values, dict(column.attributes))
        for name, column in columns_of(recording).items()
    }
    axes = ("frame", "image", "y", "x")
    variables["raw"] = _variable(axes, opened.raw, "DN", "raw images")
    chosen = [known_product(name) for name in products]
    if any(product.over_time for product in chosen):
        times = evenly(opened.recipe.base_frequency_hz)
        variables["time"] = (("time",), np.asarray(times), {"units": "s"})
    for product in chosen:
        variables[product.name] = _computed(opened, recording, product)
    return xarray.Dataset(variables, attrs=attributes_of(recording))


def _computed(opened: "OpenedRecording", recording: Recording, product: Product) -> xarray.Variable:
    times = len(evenly(opened.recipe.base_frequency_hz)) if product.over_time else 0
    frames, _, height, width = recording.shape
    shape = product.shape(opened.recipe.applied, height, width, times=times)
    description = product.description
    array = ByFrame(
        (frames, *shape),
        description.dtype,
        lambda index: opened[index].product(product.name).array,
    )
    return _variable(("frame", *description.axes), array, description.unit, description.summary)


def _variable(axes: tuple[str, ...], array: ByFrame, unit: str, says: str) -> xarray.Variable:
    attributes = {"units": unit, "long_name": says}
    return xarray.Variable(axes, indexing.LazilyIndexedArray(_Indexed(array)), attributes)
