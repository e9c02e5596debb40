"""What several processes compute of one recording, each of which reads it by itself."""

import threading
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import version
from typing import Final
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.errors import MixedVersions
from transientcam_server.imaging import Recipe
from transientcam_server.offline._place import recording_at
from transientcam_server.offline._recording import BatchOptions, BatchReconstructor
from transientcam_server.recording import Recording
from transientcam_server.settings import ReconstructionSettings

BLOCK_FRAMES: Final = 64
"""Of a task: less, and a cluster of 100 workers would wait for its scheduler."""
_PACKAGES: Final = ("transientcam", "numpy", "numba", "h5py", "isal")
"""Those that the values depend on."""
_SELDOM: Final = ("likelihood", "pairs", "harmonics", "peaks")
"""Kernels that recipes name where they need them."""
_opening: Final = threading.Lock()


def installed() -> tuple[tuple[str, str], ...]:
    """Return the packages that values depend on, with their versions."""
    return tuple((name, version(name)) for name in _PACKAGES)


def require_versions(wanted: tuple[tuple[str, str], ...]) -> None:
    """Refuse to compute here for a process that has other versions.

    Raises MixedVersions naming this worker and the package.
    """
    for (name, here), (_, there) in zip(installed(), wanted, strict=True):
        if here != there:
            raise MixedVersions(_worker(), name, here, there)


@dataclass(frozen=True, slots=True)
class Job:
    """A recording and what is computed of it; small, hashable, and of use in any process."""

    place: str
    """Path that all processes can read, or address of a daemon's recording."""
    token: str | None = field(repr=False)
    """Bearer token, where the daemon requires one."""
    products: tuple[str, ...]
    settings: str
    bins: int
    """``products``, ``settings``, ``bins``: as of `BatchOptions`; the settings as JSON."""
    versions: tuple[tuple[str, str], ...] = field(default_factory=installed)
    """Of the process that made the job."""
    run: str = field(default_factory=lambda: uuid4().hex)
    """Unlike that of any other job: files may be replaced while workers stay."""

    @classmethod
    def of(cls, place: str, options: BatchOptions, *, token: str | None = None) -> "Job":
        """Return the job with these options."""
        settings = options.settings.model_dump_json()
        return cls(place, token, options.products, settings, options.bins)

    @property
    def options(self) -> BatchOptions:
        """Products and settings."""
        settings = ReconstructionSettings.model_validate_json(self.settings)
        return BatchOptions(self.products, settings, self.bins)


def spans(frames: int) -> list[tuple[int, int]]:
    """Return the first and the last frame, exclusive, of every block of a recording."""
    starts = range(0, frames, BLOCK_FRAMES)
    return [(first, min(first + BLOCK_FRAMES, frames)) for first in starts]


def computed(job: Job, first: int, last: int) -> dict[str, NDArray[np.generic]]:
    """Return the products of some frames by name, arrays (last - first, ...).

    Raises MixedVersions if this process computes with other versions than the one that made the
    job; ServerError, TransientcamError, OSError if the recording cannot be opened here;
    DamagedFrame if a frame is not what was recorded.
    """
    recording, reconstructor = opened(job)
    previous = recording.frame(first - 1) if first else None
    rows = []
    for index in range(first, last):
        raw = recording.frame(index)
        rows.append(reconstructor.compute(raw, previous))
        previous = raw
    return {name: np.stack([row[name] for row in rows]) for name in job.products}


def opened(job: Job) -> tuple[Recording, BatchReconstructor]:
    """Return the recording of a job and what computes it, which a process keeps for its tasks."""
    with _opening:  # threads of a worker begin at the same time
        return _opened(job)


@lru_cache(maxsize=2)
def _opened(job: Job) -> tuple[Recording, BatchReconstructor]:
    require_versions(job.versions)
    recording = recording_at(job.place, token=job.token)
    try:
        reconstructor = BatchReconstructor(recording, job.options)
        load_kernels(reconstructor.recipe)
    except BaseException:
        recording.close()
        raise
    return recording, reconstructor


def load_kernels(recipe: Recipe) -> None:
    """Make the compiled kernels ready: values of NumPy differ from theirs in the last digits."""
    if not tm.kernels.state()["enabled"]:
        return
    needed = {*tm.kernels.LANES} - {*_SELDOM} | {*recipe.kernels}
    order = recipe.applied.sequence.order
    tm.kernels.compile(harmonics=[order], precisions=["float32"], names=[*needed])


def _worker() -> str:
    try:
        from distributed import get_worker

        return str(get_worker().address)
    except (ImportError, ValueError):  # Dask's schedulers of one process have none
        return "of this process"
