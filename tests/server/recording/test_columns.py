"""What every other format carries of a recording beside its images."""

import json
from pathlib import Path

import numpy as np

from tests.server.recording.made import APPLIED, header, record
from transientcam_server.recording import Recording
from transientcam_server.recording._columns import as_json, attributes_of, columns_of


def test_columns_are_series_axes_and_labels(tmp_path: Path) -> None:
    with Recording(record(tmp_path / "a.h5", 3)) as recording:
        columns = columns_of(recording)

    assert columns["frame"].values.tolist() == [1, 2, 3]
    assert columns["host_time_s"].attributes["units"] == "s"
    for name, size in (("image", 8), ("y", 12), ("x", 16)):
        assert columns[name].axes == (name,)
        assert columns[name].values.tolist() == list(range(size))
    assert columns["harmonic"].axes == ("image",)
    assert columns["harmonic"].values.tolist() == [each.harmonic for each in APPLIED.labels]
    assert columns["gain"].axes[0] == "moment"
    assert "raw" not in columns


def test_documents_are_texts(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 2, annotations={"a": [1]})
    with Recording(path) as recording:
        texts = attributes_of(recording)

    assert (texts["title"], texts["recording_id"]) == (
        "Möbius strip, 3 m",
        recording.header.recording_id,
    )
    assert texts["started_s"] == "1795161600.25"
    assert json.loads(texts["sequence"]) == APPLIED.to_document()
    assert json.loads(texts["annotations"]) == {"a": [1]}
    assert json.loads(texts["end"])["frames"] == 2
    assert json.loads(texts["camera"]) == header().camera


def test_arrays_are_lists_in_json() -> None:
    attributes = {"flag_values": np.array([1, 2], "|u1"), "units": "s"}

    assert json.loads(json.dumps(as_json(attributes))) == {"flag_values": [1, 2], "units": "s"}
