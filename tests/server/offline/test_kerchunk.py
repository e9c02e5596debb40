"""References into a recording, read by fsspec's reference file system and by kerchunk's engine."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from tests.server.recording.made import header, record
from transientcam_server.errors import InputError
from transientcam_server.offline import convert_recording
from transientcam_server.recording import Recording, RecordingWriter

FRAMES = 3
pytestmark = pytest.mark.usefixtures("zarr_clients")


def test_xarray_reads_a_file_where_it_lies(tmp_path: Path) -> None:
    source, output = record(tmp_path / "a.h5", FRAMES), tmp_path / "a.json"
    reported: list[tuple[int, int]] = []
    with Recording(source) as recording:
        convert_recording(
            recording, output, progress=lambda done, total: reported.append((done, total))
        )

    dataset = xarray.open_dataset(str(output), engine="kerchunk")

    assert reported == [(1, FRAMES), (2, FRAMES), (3, FRAMES)]
    with h5py.File(source) as file:
        for name, variable in dataset.drop_vars("captured_unix_s").variables.items():
            np.testing.assert_array_equal(variable.to_numpy(), file[str(name)][()])


def test_a_reference_names_the_address_that_it_was_given(tmp_path: Path) -> None:
    source, output = record(tmp_path / "a.h5", 1), tmp_path / "a.json"
    with Recording(source) as recording:
        convert_recording(recording, output, url="s3://bucket/a.h5")

    document = json.loads(output.read_bytes())
    assert document["templates"] == {"u": "s3://bucket/a.h5"}
    assert document["refs"]["raw/0.0.0.0"][0] == "{{u}}"


def test_other_formats_have_no_address(tmp_path: Path) -> None:
    with (
        Recording(record(tmp_path / "a.h5", 1)) as recording,
        pytest.raises(InputError, match=r"only a \.json"),
    ):
        convert_recording(recording, tmp_path / "a.mcap", url="s3://bucket/a.h5")


def test_images_in_one_piece_and_unfinished_files_are_refused(tmp_path: Path) -> None:
    source, packed = record(tmp_path / "a.h5", 1), tmp_path / "packed.h5"
    with h5py.File(source) as file, h5py.File(packed, "w") as other:
        other.attrs.update(file.attrs)
        for name in file.keys() - {"raw"}:
            file.copy(name, other)
        other.create_dataset("raw", data=file["raw"][()])
    writer = RecordingWriter(tmp_path / "new.h5", header())

    for path, match in ((packed, "stored in chunks"), (tmp_path / "new.h5.part", "unfinished")):
        with Recording(path) as recording, pytest.raises(InputError, match=match):
            convert_recording(recording, tmp_path / "b.json")
    writer.close({})
    assert not (tmp_path / "b.json").exists()
