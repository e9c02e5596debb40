import json
from pathlib import Path

import pytest

from tests.server.recording.made import record
from tests.server.recording.test_recovery import abandoned
from transientcam.cli import run
from transientcam_server.recording import Recording


def test_recover_takes_a_file_or_a_directory(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = abandoned(tmp_path / "a.h5", 2)
    assert run(["recover", str(one)]) == 0
    assert "1 of 1 recovered" in capsys.readouterr().out

    abandoned(tmp_path / "b.h5", 3)
    (tmp_path / "c.h5.part").write_bytes(b"nothing")
    assert run(["recover", str(tmp_path), "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "recovered": [str(tmp_path / "b.h5")],
        "left": [str(tmp_path / "c.h5.part")],
    }
    with Recording(tmp_path / "b.h5") as recording:
        assert recording.frames == 3


def test_recover_refuses_what_is_no_unfinished_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["recover", str(record(tmp_path / "a.h5", 1))]) == 1
    assert "ends in .part" in capsys.readouterr().err
    assert run(["recover", str(tmp_path / "absent.h5.part")]) == 1
