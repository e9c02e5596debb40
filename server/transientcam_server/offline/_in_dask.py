"""Products of a recording as Dask arrays; needs dask and xarray."""

from operator import getitem

from transientcam_server.errors import MissingExtra
from transientcam_server.offline._computing import known_product
from transientcam_server.offline._job import Job, computed, spans
from transientcam_server.offline._recording import BatchReconstructor, content_of, document_of
from transientcam_server.recording import Recording

try:
    import dask.array
    import xarray
    from dask.delayed import delayed
except ModuleNotFoundError as error:
    raise MissingExtra("reconstruct", error.name or "dask", "cluster") from error


def dataset(recording: Recording, job: Job) -> xarray.Dataset:
    """Return the products of a job, with their axes and times."""
    for name in job.products:
        known_product(name)
    reconstructor = BatchReconstructor(recording, job.options)
    content = content_of(recording, reconstructor, document_of(recording, job.options))
    blocks = [
        (last - first, delayed(computed, pure=True)(job, first, last))
        for first, last in spans(recording.frames)
    ]
    variables = {
        name: xarray.Variable(column.axes, column.values, dict(column.attributes))
        for name, column in content.columns.items()
    }
    variables["frame"] = xarray.Variable(("frame",), recording.series("frame"))
    for name, block in content.blocks.items():
        parts = [
            dask.array.from_delayed(
                delayed(getitem)(part, name), (rows, *block.shape[1:]), block.dtype
            )
            for rows, part in blocks
        ]
        array = dask.array.concatenate(parts)
        variables[name] = xarray.Variable(block.axes, array, dict(block.attributes))
    return xarray.Dataset(variables, attrs=dict(content.attributes))
