"""Calibrations are measured, used, taken elsewhere, and refused where they are not good."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from pydantic import ValidationError

from tests.server.contract import client_of
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import Camera, wire
from transientcam_driver import Sequence
from transientcam_server.api._documents.calibration import CalibrationRequest

CALIBRATIONS = "/api/v1/calibrations"
QUICK = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Served]:
    """A camera whose light shines at its sensor."""
    with serving("sim:calibration", calibrations={"directory": tmp_path / "kept"}) as daemon:
        yield daemon


@pytest.fixture
def http(bench: Served) -> Iterator[httpx.Client]:
    with client_of(bench) as client:
        yield client


def job_of(answer: httpx.Response) -> httpx.URL:
    return answer.url.join(answer.headers["location"])


def measured(http: httpx.Client, **wanted: Any) -> dict[str, Any]:
    """The job that measured a calibration, after its end."""
    answer = http.post(CALIBRATIONS, json={"frames": 3, **wanted})
    assert answer.status_code == 202, answer.text
    while True:
        job: dict[str, Any] = http.get(job_of(answer), params={"wait_s": 30}).json()
        if job["state"] != "running":
            return job


def next_meta(http: httpx.Client) -> dict[str, Any]:
    """What is known of the second frame from now on: the first one may be on its way already."""
    after = http.get("/api/v1/frames/latest", params={"wait_s": 10}).json()["frame"]
    query = {"wait_s": 10, "after": after + 1}
    meta: dict[str, Any] = http.get("/api/v1/frames/latest", params=query).json()
    return meta


def test_a_calibration_is_measured_and_used(bench: Served, http: httpx.Client) -> None:
    before = http.get("/api/v1/sequence").json()

    job = measured(http, name="after warm-up", activate=True)

    assert job["result"]["harmonics"] is None
    assert "30 takes or more" in job["result"]["no_harmonics"]
    assert (job["state"], job["progress"], job["problem"]) == ("done", 1.0, None)
    identity = job["result"]["calibration"]
    document = http.get(f"{CALIBRATIONS}/{identity}").json()
    assert document["name"] == "after warm-up"
    assert document["fits"]
    assert document["active"]
    assert document["device"]["serial"] == bench.camera.capabilities.serial
    assert document["age_s"] < 60.0
    assert next_meta(http)["calibration_id"] == identity
    after = http.get("/api/v1/sequence").json()
    assert {**before, "sequence_id": 0} == {**after, "sequence_id": 0}
    listed = http.get(CALIBRATIONS).json()
    assert listed["active"] == identity
    assert [each["id"] for each in listed["calibrations"]] == [identity]


def test_harmonics_are_measured_by_a_phase_sweep_and_taken_out(tmp_path: Path) -> None:
    """At 23 MHz the third harmonic of the prototype is 11.1 %, before the sub-phases' share."""
    phases_rad = np.arccos(1 - (2 * np.arange(4) + 1) / 4)
    gain = abs(np.exp(-3j * phases_rad).sum() / np.exp(-1j * phases_rad).sum())
    kept = {"directory": tmp_path / "kept"}
    with (
        serving("sim:calibration?device=prototype", calibrations=kept) as daemon,
        client_of(daemon) as http,
    ):
        sub_phases = {"scheme": "arccos", "n": 4}
        # two frequencies have four sums of opposite images, which find corrupt ones in each take
        sequence = QUICK | {"harmonics": 2, "sub_phases": sub_phases}
        http.put("/api/v1/sequence", json=sequence)
        result = measured(http, frames=30, activate=True, force=True)["result"]
        document = http.get(f"{CALIBRATIONS}/{result['calibration']}").json()
        meta = meta_of_flags(http)
        http.put("/api/v1/reconstruction", json={"modulation_harmonics": "keep"})
        plain = meta_of_flags(http)

    assert result["no_harmonics"] is None
    assert document["harmonics"] == result["harmonics"]
    assert document["harmonics"]["orders"] == list(range(3, 31, 2))
    assert document["harmonics"]["share"][0][0] == pytest.approx(0.111 * gain, abs=3e-4)
    assert meta["calibration_id"] == plain["calibration_id"] == result["calibration"]
    assert meta["corrected_pixels"] > 0.5 * 163 * 120
    assert plain["corrected_pixels"] is None


def meta_of_flags(http: httpx.Client) -> Mapping[str, Any]:
    """What is known of a frame from now on once its moments are computed."""
    answer = http.get(f"/api/v1/frames/{next_meta(http)['frame']}/flags")
    return wire.parse_frame(answer.content).meta


def test_the_active_one_says_how_many_pixels_are_invalid(http: httpx.Client) -> None:
    measured(http, activate=True)
    next_meta(http)

    (listed,) = http.get(CALIBRATIONS).json()["calibrations"]

    # the light still shines at the sensor, so nothing has drifted
    assert 0.0 <= listed["drift"]["invalid_share"] < 0.02
    assert 0.0 <= listed["drift"]["invalid_share_at_capture"] < 0.02
    metrics = http.get("/metrics").text
    assert "transientcam_calibration_active 1.0" in metrics
    assert "transientcam_calibration_invalid_pixels_ratio" in metrics


def test_without_an_active_one_frames_are_nominal_and_nothing_drifts(http: httpx.Client) -> None:
    measured(http)

    listed = http.get(CALIBRATIONS).json()

    assert listed["active"] == "nominal"
    assert listed["calibrations"][0]["drift"] is None
    assert next_meta(http)["calibration_id"] == "nominal"


def test_one_for_another_sequence_is_refused_with_the_reason(http: httpx.Client) -> None:
    identity = measured(http)["result"]["calibration"]
    http.put("/api/v1/sequence", json=QUICK)

    answer = http.put(f"{CALIBRATIONS}/active", json={"id": identity})

    assert answer.status_code == 409
    problem = answer.json()
    assert problem["type"] == "/problems/calibration-misfit"
    assert (problem["field"], problem["value"], problem["limit"]) == ("harmonics", 1, 3)
    document = http.get(f"{CALIBRATIONS}/{identity}").json()
    assert not document["fits"]
    assert document["reason"] == "the calibration is for harmonics = 3, not 1"
    assert http.get(f"{CALIBRATIONS}/active").json()["id"] == "nominal"


def test_an_active_one_waits_for_a_sequence_that_it_is_good_for(http: httpx.Client) -> None:
    identity = measured(http, activate=True)["result"]["calibration"]

    http.put("/api/v1/sequence", json=QUICK)
    meanwhile = http.get(f"{CALIBRATIONS}/active").json()
    http.put("/api/v1/sequence", json={})

    assert (meanwhile["id"], meanwhile["calibration_id"]) == (identity, "nominal")
    assert "harmonics" in meanwhile["reason"]
    assert http.get(f"{CALIBRATIONS}/active").json()["calibration_id"] == identity


def test_it_is_taken_home_deleted_and_taken_in_again(http: httpx.Client) -> None:
    identity = measured(http, name="mine")["result"]["calibration"]
    file = http.get(f"{CALIBRATIONS}/{identity}/file")
    assert file.headers["content-type"] == "application/octet-stream"

    gone = http.delete(f"{CALIBRATIONS}/{identity}")
    assert gone.json()["id"] == identity
    assert http.get(f"{CALIBRATIONS}/{identity}").status_code == 404
    taken = http.post(f"{CALIBRATIONS}/import", content=file.content)
    again = http.post(f"{CALIBRATIONS}/import", content=file.content)

    assert taken.status_code == again.status_code == 201
    assert taken.json()["id"] == again.json()["id"] == identity
    assert taken.json()["name"] == "mine"
    assert len(http.get(CALIBRATIONS).json()["calibrations"]) == 1


def test_part_of_a_file_can_be_had(http: httpx.Client) -> None:
    path = f"{CALIBRATIONS}/{measured(http)['result']['calibration']}/file"
    whole = http.get(path).content

    assert http.get(path, headers={"Range": "bytes=4-"}).content == whole[4:]
    assert http.get(path, headers={"Range": f"bytes={len(whole)}-"}).status_code == 416


def test_one_of_another_camera_is_kept_and_cannot_be_used(http: httpx.Client) -> None:
    identity = measured(http)["result"]["calibration"]
    content = http.get(f"{CALIBRATIONS}/{identity}/file").content
    with (
        serving("sim:wall?device=prototype") as other,
        httpx.Client(base_url=other.url, timeout=60) as theirs,
    ):
        taken = theirs.post(f"{CALIBRATIONS}/import", content=content).json()
        refused = theirs.put(f"{CALIBRATIONS}/active", json={"id": identity})

    assert not taken["fits"]
    assert refused.status_code == 409
    assert refused.json()["field"] == "serial"


@pytest.mark.parametrize("content", [b"", b"no npz", b"PK\x03\x04 nearly", b"\x00" * 70_000])
def test_what_is_no_calibration_is_not_taken_in(
    bench: Served, http: httpx.Client, content: bytes
) -> None:
    answer = http.post(f"{CALIBRATIONS}/import", content=content)

    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/invalid-calibration"
    assert str(bench.settings.calibrations.directory) not in answer.text
    assert list(bench.settings.calibrations.directory.glob("*")) == []


def test_a_number_of_frames_is_an_integer_as_json_schema_has_it() -> None:
    assert CalibrationRequest.model_validate_json('{"frames": 40.0}').frames == 40
    for refused in ("40.5", '"40"', "true", "1e400", "null"):
        with pytest.raises(ValidationError, match="frames"):
            CalibrationRequest.model_validate_json(f'{{"frames": {refused}}}')


def test_a_disk_that_takes_nothing_is_a_problem_and_no_more(tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.write_text("no directory")
    with (
        serving("sim:calibration", calibrations={"directory": occupied / "kept"}) as daemon,
        client_of(daemon) as http,
    ):
        sent = http.post(f"{CALIBRATIONS}/import", content=b"PK")
        job = measured(http)
        assert next_meta(http)["calibration_id"] == "nominal"

    assert sent.status_code == 507
    assert sent.json()["type"] == "/problems/calibration-not-stored"
    assert job["problem"]["type"] == "/problems/calibration-not-stored"
    assert str(occupied) not in sent.text


def test_a_file_beyond_the_limit_is_refused(tmp_path: Path) -> None:
    limits = {"directory": tmp_path, "max_bytes": 2048}
    with serving("sim:calibration", calibrations=limits) as daemon, client_of(daemon) as http:
        answer = http.post(f"{CALIBRATIONS}/import", content=b"\x00" * 4096)

    assert answer.status_code == 413
    assert answer.json()["limit"] == 2048
    assert list(tmp_path.glob("*")) == []


def test_more_than_are_kept_are_refused_before_anything_is_captured(tmp_path: Path) -> None:
    limits = {"directory": tmp_path, "max_count": 1}
    with (
        serving("sim:calibration", calibrations=limits) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60) as http,
    ):
        http.put("/api/v1/sequence", json=QUICK)
        assert measured(http)["state"] == "done"
        second = measured(http)

    assert second["state"] == "failed"
    assert second["problem"]["type"] == "/problems/calibration-not-stored"


def test_one_of_a_scene_is_kept_but_used_only_if_forced_and_undone_at_once(
    http: httpx.Client,
) -> None:
    http.put("/api/v1/simulation", json={"scene": "mirrors"})

    result = measured(http, activate=True)["result"]

    identity = result["calibration"]
    assert result["verdict"]["verdict"] == "scene"
    assert not result["activated"]
    document = http.get(f"{CALIBRATIONS}/{identity}").json()
    assert document["verdict"] == result["verdict"]
    assert (document["active"], document["forced"]) == (False, False)
    refused = http.put(f"{CALIBRATIONS}/active", json={"id": identity})
    assert refused.status_code == 409
    problem = refused.json()
    assert problem["type"] == "/problems/calibration-doubted"
    assert problem["verdict"] == "scene"
    assert "unlike a diffuser" in problem["detail"]
    assert http.get(f"{CALIBRATIONS}/active").json()["id"] == "nominal"

    forced = http.put(f"{CALIBRATIONS}/active", json={"id": identity, "force": True}).json()
    assert (forced["id"], forced["former"]) == (identity, "nominal")
    undone = http.post(f"{CALIBRATIONS}/active/undo").json()
    assert (undone["id"], undone["former"]) == ("nominal", identity)


def test_one_of_a_scene_is_no_reference_for_another(http: httpx.Client) -> None:
    http.put("/api/v1/simulation", json={"scene": "mirrors"})
    assert measured(http, activate=True, force=True)["result"]["activated"]

    again = measured(http, activate=True)["result"]

    assert (again["verdict"]["verdict"], again["activated"]) == ("scene", False)


def test_the_diffuser_is_put_before_the_lens_and_the_scene_is_behind_it(http: httpx.Client) -> None:
    http.put("/api/v1/simulation", json={"scene": "mirrors"})
    through = http.put("/api/v1/simulation", json={"diffuser": True}).json()
    result = measured(http, activate=True)["result"]
    scene = http.put("/api/v1/simulation", json={"diffusor": False}).json()

    assert (through["scene"], through["diffusor"]) == ("mirrors", True)
    assert result["verdict"]["verdict"] == "diffusor"
    assert result["verdict"]["reason"] is None
    assert (result["activated"], result["former"]) == (True, "nominal")
    assert (scene["scene"], scene["diffusor"]) == ("mirrors", False)


def test_there_is_nothing_to_return_to_before_another_was_used_or_once_it_is_deleted(
    http: httpx.Client,
) -> None:
    first = http.post(f"{CALIBRATIONS}/active/undo")
    identity = measured(http, activate=True)["result"]["calibration"]
    http.put(f"{CALIBRATIONS}/active", json={"id": "nominal"})
    assert http.get(CALIBRATIONS).json()["former"] == identity
    http.delete(f"{CALIBRATIONS}/{identity}")
    second = http.post(f"{CALIBRATIONS}/active/undo")

    for refused in (first, second):
        assert refused.status_code == 409
        assert refused.json()["type"] == "/problems/no-former-calibration"
    assert http.get(CALIBRATIONS).json()["former"] is None


def test_the_active_one_is_not_deleted_until_it_is_not(http: httpx.Client) -> None:
    identity = measured(http, activate=True)["result"]["calibration"]

    refused = http.delete(f"{CALIBRATIONS}/{identity}")
    http.put(f"{CALIBRATIONS}/active", json={"id": "nominal"})

    assert refused.status_code == 409
    assert refused.json()["type"] == "/problems/calibration-in-use"
    assert http.delete(f"{CALIBRATIONS}/{identity}").status_code == 200
    assert http.get(CALIBRATIONS).json()["calibrations"] == []


@pytest.mark.parametrize("name", ["unknown", "..%2f..%2fetc%2fpasswd", "nominal"])
def test_an_unknown_one_is_a_problem(http: httpx.Client, name: str) -> None:
    assert http.get(f"{CALIBRATIONS}/{name}").status_code == 404
    assert http.delete(f"{CALIBRATIONS}/{name}").status_code == 404
    if name == "unknown":
        assert http.put(f"{CALIBRATIONS}/active", json={"id": name}).status_code == 404


def test_the_next_start_has_the_active_one(tmp_path: Path) -> None:
    kept = {"directory": tmp_path}
    with (
        serving("sim:calibration", calibrations=kept) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60) as http,
    ):
        identity = measured(http, activate=True)["result"]["calibration"]

    with (
        serving("sim:wall", calibrations=kept) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60) as http,
    ):
        assert next_meta(http)["calibration_id"] == identity
    with (
        serving("sim:wall?device=prototype", calibrations=kept) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60) as http,
    ):
        assert http.get(f"{CALIBRATIONS}/active").json()["id"] == "nominal"


# -- while it is measured ----------------------------------------------------------------------


def started(http: httpx.Client) -> httpx.URL:
    """Address of a job that would take minutes, once it captures."""
    answer = http.post(CALIBRATIONS, json={"frames": 2000})
    job = job_of(answer)
    wait_until(lambda: http.get(job).json()["step"] == "capturing")
    return job


def test_meanwhile_the_camera_is_for_the_job_alone(http: httpx.Client) -> None:
    job = started(http)

    assert http.get("/api/v1/acquisition").json()["state"] == "calibrating"
    assert http.get("/api/v1/camera").json()["status"] is not None
    for answer in (
        http.put("/api/v1/sequence", json=QUICK),
        http.put("/api/v1/acquisition", json={"running": True}),
        http.post(CALIBRATIONS, json={}),
        http.post("/api/v1/recordings", json={}),
    ):
        assert answer.status_code == 409
        assert answer.json()["type"] == "/problems/camera-busy"
        assert str(job).endswith(answer.json()["job"])
    http.post(f"{job}/cancel")


def test_it_is_of_the_sequence_that_there_is_when_it_begins(
    bench: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def changed() -> None:
        assert http.put("/api/v1/sequence", json=QUICK).status_code == 200

    # the last moment at which it has not the camera for itself
    monkeypatch.setattr(bench.service.calibrations.store, "require_room", changed)

    job = measured(http, activate=True)

    assert (job["state"], job["problem"]) == ("done", None)
    assert job["result"]["images"] == 3 * http.get("/api/v1/sequence").json()["images"]
    assert job["result"]["activated"]


def test_it_is_cancelled_and_frames_come_again(http: httpx.Client) -> None:
    sequence = http.get("/api/v1/sequence").json()
    job = started(http)

    http.post(f"{job}/cancel")

    assert http.get(job, params={"wait_s": 30}).json()["state"] == "cancelled"
    assert next_meta(http)["calibration_id"] == "nominal"
    assert http.get("/api/v1/acquisition").json()["state"] == "streaming"
    assert http.get("/api/v1/sequence").json()["harmonics"] == sequence["harmonics"]
    assert http.get(CALIBRATIONS).json()["calibrations"] == []


def test_the_light_can_be_switched_off_which_ends_it(bench: Served, http: httpx.Client) -> None:
    job = started(http)

    http.post("/api/v1/acquisition/safe-off")

    assert http.get(job, params={"wait_s": 30}).json()["state"] == "cancelled"
    assert http.get("/api/v1/acquisition").json()["state"] == "stopped"
    assert not http.get("/api/v1/camera").json()["status"]["light_on"]
    assert bench.camera.applied.sequence == Sequence()


def test_a_lease_that_lapses_ends_it(bench: Served, http: httpx.Client) -> None:
    lease = http.post("/api/v1/lease", json={"holder": "bench"}).json()
    own = {"Transientcam-Lease": lease["lease_id"]}
    assert http.post(CALIBRATIONS, json={}).json()["type"] == "/problems/lease-held"
    answer = http.post(CALIBRATIONS, json={"frames": 2000}, headers=own)
    http.put("/api/v1/lease", json={"duration_s": 1.0}, headers=own)

    ended = http.get(job_of(answer), params={"wait_s": 30}).json()

    assert ended["state"] == "cancelled"
    assert http.get("/api/v1/acquisition").json()["state"] == "stopped"


def test_a_camera_lost_meanwhile_fails_it_and_comes_back_as_it_was(
    bench: Served, http: httpx.Client
) -> None:
    job = started(http)
    http.post("/api/v1/simulation/faults", json={"fault": "unplug"})

    ended = http.get(job, params={"wait_s": 30}).json()
    http.post("/api/v1/simulation/faults", json={"fault": "replug"})
    meta = next_meta(http)

    assert ended["state"] == "failed"
    assert ended["problem"]["type"] == "/problems/camera-lost"
    assert meta["harmonics"] == 3
    assert http.get("/api/v1/sequence").json()["takes"] == 1


def test_the_service_ends_in_the_middle_of_it(tmp_path: Path) -> None:
    with (
        serving("sim:calibration", calibrations={"directory": tmp_path}) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60) as http,
    ):
        started(http)
    assert list(tmp_path.glob("*")) == []
    assert daemon.camera.applied.sequence.zeroth != "on-off"


def test_streams_are_notified(bench: Served) -> None:
    notices: list[Any] = []
    with (
        Camera(bench.url, timeout_s=60) as camera,
        camera.stream("range", on_notice=notices.append) as stream,
        httpx.Client(base_url=bench.url, timeout=60) as http,
    ):
        frames = iter(stream)
        next(frames)
        identity = measured(http, activate=True)["result"]["calibration"]
        next(each for each in frames if each.meta["calibration_id"] == identity)

    reported = [each.details["job"]["state"] for each in notices if each.kind == "job-changed"]
    assert reported == ["running", "done"]
    (changed,) = [each.details for each in notices if each.kind == "calibration-changed"]
    assert changed == {"calibration_id": identity, "reason": None, "warning": None}
