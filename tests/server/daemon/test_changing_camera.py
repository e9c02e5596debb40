"""One process serves a camera, then another: from none to a range map, and on."""

import io
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.server.daemon.test_server import PATIENCE_S, daemon
from tests.waiting import wait_until
from transientcam_driver import CameraLost
from transientcam_server.api import build_app
from transientcam_server.camera import AbsentCamera
from transientcam_server.cli.serve import settings_for
from transientcam_server.settings import Settings


def test_from_no_camera_to_a_range_map_and_on_to_another(tmp_path: Path) -> None:
    kept = str(tmp_path / "recordings")
    with daemon(tmp_path, "--camera", "none", TRANSIENTCAM_RECORDINGS__DIRECTORY=kept) as (
        process,
        url,
    ):
        with httpx.Client(base_url=f"{url}/api/v1", timeout=PATIENCE_S) as http:

            def changed(camera: str) -> None:
                before = http.get("/info").json()["service_id"]
                assert http.put("/camera", json={"camera": camera}).status_code == 202
                wait_until(lambda: _service_id(http) not in (before, None))

            assert http.get("/camera").json()["state"] == "lost"
            assert http.put("/sequence", json={"harmonics": 3}).status_code == 503
            assert "sim:wall" in http.get("/camera/choices").json()["simulated"]

            changed("sim:wall")
            range_m = _range_m(http)
            assert range_m.shape == (120, 163)

            recording = http.post("/recordings", json={}).json()["id"]
            served = http.get("/info").json()["service_id"]
            refused = http.put("/camera", json={"camera": "sim:nowhere"})
            assert refused.status_code == 502
            assert (refused.json()["field"], refused.json()["value"]) == ("camera", "sim:nowhere")
            assert http.get("/info").json()["service_id"] == served

            changed("sim:corner")
            assert not np.allclose(_range_m(http), range_m, atol=0.1, equal_nan=True)
            (listed,) = http.get("/recordings").json()["recordings"]
            assert (listed["id"], listed["state"]) == (recording, "complete")
        process.terminate()
        process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 0


def _service_id(http: httpx.Client) -> str | None:
    """Return it; None where the former service just closed the connection."""
    try:
        return str(http.get("/info").json()["service_id"])
    except httpx.TransportError:
        return None


def _range_m(http: httpx.Client) -> Any:
    wait_until(lambda: http.get("/frames").json()["last"] is not None)
    answer = http.get("/frames/latest/range.npy")
    return np.load(io.BytesIO(answer.raise_for_status().content))


def test_a_camera_that_cannot_be_opened_is_taken_once_it_can() -> None:
    camera = AbsentCamera(wanted="usb:no-such-camera")
    with pytest.raises(CameraLost, match="usb:no-such-camera cannot be opened"):
        camera.reconnect()
    assert camera.found is None

    there = AbsentCamera(wanted="sim:wall")
    service: Any = build_app(there, Settings(camera="none")).state.service
    assert not service.successor
    with pytest.raises(CameraLost):
        there.reconnect()
    name, opened = service.successor
    opened.close()
    assert name == "sim:wall"


def test_what_was_set_for_one_camera_does_not_hold_for_another() -> None:
    settings = Settings.model_validate(
        {"camera": "sim:wall", "workers": 3, "sequence": {"harmonics": 6}, "calibration": "a.npz"}
    )

    assert settings_for(settings, "sim:wall") is settings
    other = settings_for(settings, "sim:corner")
    assert (other.camera, other.workers, other.calibration) == ("sim:corner", 3, None)
    assert other.sequence == Settings().sequence
