"""Products of every frame of a recording, computed on a Dask cluster into a Zarr store.

A task is some frames: its worker reads them from the recording and writes them into the store. No
frame goes through the scheduler, and tasks write different chunks. Which frames are there the store
itself says, so that a second run goes on with those that are missing.
"""

import math
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import CancelledError
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_server.errors import ClusterError, MissingExtra, StorageError
from transientcam_server.offline._formats import (
    Block,
    Content,
    create_zarr,
    every_chunk,
    finish_zarr,
    library,
    naming_address,
)
from transientcam_server.offline._job import BLOCK_FRAMES, Job, computed, opened, spans
from transientcam_server.offline._place import recording_at
from transientcam_server.offline._recording import (
    BatchOptions,
    BatchReconstructor,
    content_of,
    document_of,
    require_same,
)
from transientcam_server.recording import Recording

try:
    import distributed
    from distributed.comm.core import CommClosedError
except ModuleNotFoundError as error:
    raise MissingExtra("a cluster", "distributed", "cluster") from error

COUNTING: Final = "frame"
"""The array that a task writes last: frames that it lacks are still to be computed."""
MISSING: Final = 2**64 - 1
_CHUNK_BYTES: Final = 8 * 1024**2
"""Of a chunk, at most: objects of this size are what S3 moves well."""


def reconstruct_on(
    client: distributed.Client,
    place: str,
    output: str,
    options: BatchOptions,
    *,
    token: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[int, int]:
    """Compute products of all frames into a Zarr store; return all frames, and those it had before.

    ``client``: of the cluster.
    ``place``: of the recording: a path that all workers can read, or the address of a daemon's
    recording.
    ``output``: a directory that all workers can write, or any address that fsspec knows. A store
    that is not complete is gone on with.
    ``token``: bearer token, where the daemon requires one.
    Raises FileExistsError if the output is there already, complete, or is a directory of something
    else.
    Raises InputError if what was begun there is of another recording, or made with other settings.
    Raises MixedVersions if a worker has other versions of what the values depend on.
    Raises ClusterError if the scheduler is lost, or a task ended several workers.
    Raises DamagedFrame if a frame is not what was recorded.
    Raises StorageError if what is behind the output's address refuses, as where a bucket is
    missing.
    Raises ServerError, TransientcamError, OSError if the recording cannot be read, or the output
    not be written.
    """
    job = Job.of(place, options, token=token)
    with recording_at(place, token=token) as recording:
        with naming_address(output):
            group = _begun(recording, output, options)
            there = np.asarray(group[COUNTING][:]) != MISSING
        frames = recording.frames
    missing = [(first, last) for first, last in spans(frames) if not there[first:last].all()]
    left = sum(last - first for first, last in missing)
    _compute(client, job, output, missing, lambda done: progress(frames - left + done, frames))
    with naming_address(output):
        finish_zarr(output)
    return frames, frames - left


def write_block(job: Job, output: str, first: int, last: int) -> None:
    """Compute some frames and write them: what a task is."""
    try:
        _write_block(job, output, first, last)
    except StorageError as error:
        # the errors of backends behind it are not all such that they can be sent to the client
        error.__cause__ = error.__context__ = None
        raise


def _write_block(job: Job, output: str, first: int, last: int) -> None:
    tm.kernels.use_one_thread()  # a worker has a process, or a thread, for every core
    with naming_address(output):
        group = _group(job, output)
    recording, _ = opened(job)
    rows = group[job.products[0]].chunks[0]
    for begin in range(first, last, rows):  # all frames of a task might not fit in memory
        end = min(begin + rows, last)
        found = computed(job, begin, end)
        with naming_address(output):
            for name, values in found.items():
                every_chunk(group[name])[begin:end] = values
    with naming_address(output):
        every_chunk(group[COUNTING])[first:last] = recording.series(COUNTING)[first:last]


@lru_cache(maxsize=2)
def _group(job: Job, output: str) -> Any:
    """Return the group of a store, which a worker opens once for each run."""
    return library("zarr", "a .zarr").open_group(output, mode="r+", use_consolidated=False)


def _begun(recording: Recording, output: str, options: BatchOptions) -> Any:
    """Return the group of a store, new or begun before."""
    document = document_of(recording, options) | {"frames": str(recording.frames)}
    try:
        group = library("zarr", "a .zarr").open_group(output, mode="r+")
    except FileNotFoundError:
        if "://" not in output and Path(output).is_dir() and any(Path(output).iterdir()):
            raise FileExistsError(17, "it is there already, and no Zarr store", output) from None
        return _laid_out(recording, output, options, document, overwrite=False)
    require_same(output, group.attrs, document)
    if group.metadata.consolidated_metadata is not None:
        raise FileExistsError(17, "it is there already", output)
    if COUNTING in group:
        return group
    # it was interrupted before its first frame
    return _laid_out(recording, output, options, document, overwrite=True)


def _laid_out(
    recording: Recording,
    output: str,
    options: BatchOptions,
    document: Mapping[str, str],
    *,
    overwrite: bool,
) -> Any:
    content = content_of(recording, BatchReconstructor(recording, options), document)
    counting = Block((COUNTING,), (recording.frames,), "<u8", missing=MISSING)
    rows = _rows_of_chunk(content.blocks.values())
    return create_zarr(
        output,
        # the last one made, by which a whole layout is known
        Content(content.columns, {**content.blocks, COUNTING: counting}, content.attributes),
        rows_of_chunk=lambda block: BLOCK_FRAMES if block is counting else rows,
        overwrite=overwrite,
    )


def _rows_of_chunk(blocks: Iterable[Block]) -> int:
    """Return a power of two, so that a task writes whole chunks, of the largest product's size."""
    row_bytes = max(math.prod(block.shape[1:]) * np.dtype(block.dtype).itemsize for block in blocks)
    fitting = max(1, _CHUNK_BYTES // row_bytes)
    return min(BLOCK_FRAMES, 1 << (fitting.bit_length() - 1))


def completed(
    client: distributed.Client, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
) -> Generator[tuple[tuple[Any, ...], Any], None, None]:
    """Yield each task with its result as it is done; close it, and the tasks that are left end.

    ``client``: of the cluster.
    ``function``: of a module that every worker has, or else it is sent there.
    ``tasks``: arguments of one call each.
    Raises ClusterError if the scheduler is lost, or a task ended several workers; Exception
    whatever a task raises.
    """
    assert client.scheduler is not None  # noqa: S101 - it is connected
    address = str(client.scheduler.address)
    futures, of = [], {}
    done = 0
    try:
        for task in tasks:
            future = client.submit(function, *task, pure=False)
            of[future.key] = task
            futures.append(future)
        if not futures:
            return
        for future in distributed.as_completed(futures, loop=client.loop):
            result = future.result()
            done += 1
            yield of[future.key], result
    except (distributed.KilledWorker, CommClosedError, CancelledError) as error:
        raise ClusterError(address, str(error) or type(error).__name__) from error
    finally:
        if done < len(futures) and client.status == "running":
            client.cancel(futures)


def _compute(
    client: distributed.Client,
    job: Job,
    output: str,
    blocks: list[tuple[int, int]],
    progress: Callable[[int], None],
) -> None:
    """Have the blocks computed; whatever ends this before ends the tasks that are left."""
    done = 0
    progress(done)
    tasks = ((job, output, first, last) for first, last in blocks)
    with closing(completed(client, write_block, tasks)) as results:
        for (_, _, first, last), _ in results:
            done += last - first
            progress(done)
