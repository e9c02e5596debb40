"""An open recording as a sequence of frames whose products are computed when they are read.

The arithmetic is the daemon's: the same recipe, stages and products. `transientcam.open` finds
`open_recording` by its entry point and says in its protocols what users find here.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

from numpy.typing import NDArray
from pydantic import ValidationError

from transientcam.notebook import table_html
from transientcam_server.errors import InputError
from transientcam_server.imaging import (
    Recipe,
    SettingsVersion,
    image_columns,
    in_words,
    nominal_gains,
)
from transientcam_server.offline._computing import ComputedFrame
from transientcam_server.offline._images import ByFrame, raw_images
from transientcam_server.offline._place import recording_at
from transientcam_server.recording import Recording, recorded_recipe
from transientcam_server.settings import ReconstructionSettings

if TYPE_CHECKING:
    import xarray

_RECORDED_ID = 0
"""Id, in the metadata, of settings that are those of a file."""


def open_recording(
    place: str,
    *,
    token: str | None = None,
    settings: Mapping[str, Any] | None = None,
    timeout_s: float = 10.0,
) -> "OpenedRecording":
    """Open the recording at a path, or a daemon's by its address; see `transientcam.open`.

    Raises NotARecording if it cannot be read as one; InputError if its settings cannot be used;
    TransientcamError if the daemon does not have it; OSError if there is no such file.
    """
    recording = recording_at(place, token=token, timeout_s=timeout_s)
    try:
        return OpenedRecording(recording, settings, place=place, token=token)
    except BaseException:
        recording.close()
        raise


class OpenedRecording(Sequence[ComputedFrame]):
    """A recording as a sequence of its frames; see `transientcam.Recording`."""

    def __init__(
        self,
        recording: Recording,
        settings: Mapping[str, Any] | None = None,
        *,
        place: str | None = None,
        token: str | None = None,
    ) -> None:
        self._recording = recording
        # where other processes find it
        self._place, self._token = place or str(recording.path), token
        header = recording.header
        try:
            if settings is None:
                chosen = ReconstructionSettings.recorded(header.reconstruction)
            else:
                chosen = ReconstructionSettings.model_validate(dict(settings))
        except ValidationError as error:
            mistake = error.errors()[0]
            place = ".".join(map(str, mistake["loc"]))
            raise InputError(
                str(recording.path),
                f"reconstruction.{place}",
                repr(mistake.get("input")),
                f"usable ({mistake['msg']}); transientcam.open(..., settings={{...}}) sets others",
            ) from error
        self.recipe: Recipe = recorded_recipe(header, SettingsVersion(_RECORDED_ID, chosen))
        self.sequence: dict[str, Any] = header.applied.to_document()
        self.settings: dict[str, Any] = chosen.model_dump()
        self.gains: NDArray[Any] = (
            nominal_gains(header.applied.sequence, delay_s=header.applied.delay_s)
            if header.gains is None
            else header.gains.planes
        )
        columns = image_columns(recording.labels)
        self.labels: dict[str, NDArray[Any]] = {
            name: in_words(column) for name, column in columns.items()
        }

    @property
    def frames(self) -> "OpenedRecording":
        """The recording itself, as a sequence of frames."""
        return self

    @property
    def raw(self) -> ByFrame:
        """All images (frames, N, H, W), uint16 in DN; what is indexed is read and checked."""
        return raw_images(self._recording)

    @property
    def annotations(self) -> dict[str, Any]:
        """What people wrote about it."""
        return self._recording.annotations

    def series(self, name: str) -> NDArray[Any]:
        """Return one value a frame: ``device_time_s`` ... (docs/recordings.md); or a KeyError."""
        return self._recording.series(name)

    def to_xarray(self, *products: str) -> "xarray.Dataset":
        """Return an xarray.Dataset of images, labels and series, and of these products.

        Images are read, and products computed, when they are indexed.
        Raises MissingExtra without xarray; ParameterError for what is no product.
        """
        from transientcam_server.offline._in_xarray import dataset

        return dataset(self._recording, self, self.recipe, products)

    def reconstruct(self, *products: str, bins: int = 256) -> "xarray.Dataset":
        """Return an xarray.Dataset of these products as Dask arrays, in blocks of 64 frames.

        Nothing is computed before Dask does it, here or on a cluster: workers open the recording by
        its path or address, and no frame goes through a scheduler. Without names it has those of
        `transientcam reconstruct`.
        Raises MissingExtra without Dask or xarray; ParameterError for what is no product.
        """
        from transientcam_server.offline._in_dask import dataset
        from transientcam_server.offline._job import Job
        from transientcam_server.offline._recording import BatchOptions, default_products

        names = products or default_products(self._recording.header.applied)
        settings = ReconstructionSettings.model_validate(self.settings)
        options = BatchOptions(tuple(dict.fromkeys(names)), settings, bins)
        return dataset(self._recording, Job.of(self._place, options, token=self._token))

    @overload
    def __getitem__(self, index: int) -> ComputedFrame: ...
    @overload
    def __getitem__(self, index: slice) -> list[ComputedFrame]: ...
    def __getitem__(self, index: int | slice) -> ComputedFrame | list[ComputedFrame]:
        """Return a frame, counted from 0 or backwards from the end, or several."""
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        place = range(len(self))[index]
        return ComputedFrame(place, self.recipe, self._recording.frame)

    def __len__(self) -> int:
        return self._recording.frames

    def __iter__(self) -> Iterator[ComputedFrame]:
        return (self[index] for index in range(len(self)))

    def close(self) -> None:
        """Close the file; frames that were read stay."""
        self._recording.close()

    def __enter__(self) -> "OpenedRecording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        height, width = self._recording.shape[2:]
        return (
            f"<Recording {self._recording.header.name!r}: {len(self)} frames of "
            f"{width} x {height} pixels, m = {self.sequence['harmonics']} at "
            f"{self.sequence['base_frequency_hz'] / 1e6:g} MHz, zeroth {self.sequence['zeroth']}>"
        )

    def _repr_html_(self) -> str:
        """Return name, sequence and settings as a table, for notebooks."""
        rows = {"calibration": self._recording.header.calibration.get("id", "nominal")}
        return table_html(repr(self), rows | self.sequence | self.settings)
