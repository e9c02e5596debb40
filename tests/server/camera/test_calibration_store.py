"""The calibrations that are kept on the disk."""

import json
import time
from pathlib import Path

import pytest

from transientcam_server.camera import CalibrationStore
from transientcam_server.errors import Problem
from transientcam_server.imaging import NOMINAL_ID
from transientcam_server.settings import CalibrationSettings


def test_what_a_dead_service_left_behind_is_removed_and_what_is_being_received_is_not(
    tmp_path: Path,
) -> None:
    settings = CalibrationSettings(directory=tmp_path)
    abandoned = CalibrationStore(settings).new_part()

    today = CalibrationStore(settings).new_part()
    assert abandoned.exists()
    tomorrow = CalibrationStore(settings, unix_s=lambda: time.time() + 25 * 3600).new_part()

    assert not abandoned.exists()
    assert not today.exists()
    assert tomorrow.exists()


def test_a_file_that_is_no_calibration_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "odd.npz").write_bytes(b"PK")
    kept = CalibrationStore(CalibrationSettings(directory=tmp_path))

    assert kept.all() == []
    with pytest.raises(Problem, match="no calibration 'odd'"):
        kept.get("odd")


@pytest.mark.parametrize("content", ["", "[]", '{"id"', "{}", None])
def test_the_active_one_is_nominal_where_it_cannot_be_known(
    tmp_path: Path, content: str | None
) -> None:
    if content is not None:
        (tmp_path / "active.json").write_text(content)

    assert CalibrationStore(CalibrationSettings(directory=tmp_path)).active_id == NOMINAL_ID


def test_the_active_one_is_remembered(tmp_path: Path) -> None:
    settings = CalibrationSettings(directory=tmp_path / "kept")
    CalibrationStore(settings).remember_active("SIM-1", "nominal")

    assert CalibrationStore(settings).active_id == "SIM-1"
    assert CalibrationStore(settings).former_id == "nominal"
    remembered = json.loads((tmp_path / "kept" / "active.json").read_text())
    assert remembered == {"id": "SIM-1", "former": "nominal"}
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["active.json"]


def test_what_an_earlier_version_remembered_is_read(tmp_path: Path) -> None:
    (tmp_path / "active.json").write_text('{"id": "SIM-1"}')
    kept = CalibrationStore(CalibrationSettings(directory=tmp_path))

    assert (kept.active_id, kept.former_id) == ("SIM-1", None)


def test_a_disk_that_does_not_remember_is_no_reason_to_stop(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    kept = CalibrationStore(CalibrationSettings(directory=tmp_path / "file" / "kept"))

    kept.remember_active("SIM-1", None)

    assert kept.active_id == NOMINAL_ID
    assert kept.all() == []
