"""The examples of the OpenAPI document: what the daemon answers with a simulated camera.

``python -m tools.examples --write`` writes them.

What differs from run to run (ids, times, numbers of frames) is replaced by fixed values, and lists
of objects keep their first two.
"""

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import httpx

from benchmarks.common.daemon import daemon
from transientcam.cli import run
from transientcam_server.api._documents.document import EXAMPLES_FILE
from transientcam_server.api._documents.sequence import SequenceDocument

CAMERA: Final = "sim:mirrors?noise=off"
_KEPT: Final = 2
_DIGITS: Final = 6
_POLL_S: Final = 0.2
_STATE: Final = "/var/lib/transientcam"
_URL: Final = "http://192.168.1.20:8000"
_RECORDING: Final = {
    "name": "corner at 3 m",
    "frames": 4,
    "annotations": {"sample": "corner, white paint", "operator": "Åsa"},
}
_CALIBRATED: Final = {"bytes": 549616}
_RECORDED: Final = {"duration_s": 0.2832, "size_bytes": 1469000}
_HISTORY: Final = {"first": 1099, "last": 1204, "count": 106, "bytes": 66347520, "seconds": 9.94}
_FIXED: Final[dict[str, Any]] = {
    "frame": 1204,
    "scene_of_frame": 1204,
    "sequence_id": 1,
    "device_time_s": 113.52,
    "host_time_s": 1795161600.25,
    "created_at": 1795161600.25,
    "finished_at": 1795161612.5,
    "started_s": 1795161600.25,
    "reconstruct_s": 0.0042,
    "computing_share": 0.0445,
    "rate_hz": 10.6,
    "frames": 1204,
    "frame_age_s": 0.031,
    "age_s": 3600.0,
    "seen_s": 0.4,
    "expires_in_s": 21.4,
    "free_bytes": 214748364800,
    "lease_id": "u3Zk1yTq0v8wWlXeGd5J2A",
    "counters": {"images": 19264},
    "status": {"next_image": 19264, "fifo_high_water_bytes": 195920},
    "history": _HISTORY,
    "kernels": {"enabled": True},
    "recordings": _RECORDED | {"frames": 4},
    "stores": {"frames": 4},
    "versions": {"transientcam": "0.2.0", "h5py": "3.16.0", "numpy": "2.4.6"},
    "calibrations": _CALIBRATED,
    "CalibrationDocument": _CALIBRATED,
    "HistoryDocument": _HISTORY,
    "RecordingDocument": _RECORDED | {"frames": 4},
    "TimelineDocument": {
        "duration_s": 0.2832,
        "frame_rate_hz": 10.5932,
        "times_s": [0.0, 0.0944, 0.1888, 0.2832],
    },
}
"""What a field has in the examples wherever it is, unless it is null; a map is for its parts."""


def examples() -> dict[str, Any]:
    """Return an example of each document, by the name of its model."""
    with TemporaryDirectory() as directory:
        environment = {
            "TRANSIENTCAM_KERNELS": "off",  # which are ready would depend on the moment
            "TRANSIENTCAM_ANNOUNCE": "on",
            "TRANSIENTCAM_RECORDINGS__DIRECTORY": f"{directory}/recordings",
            "TRANSIENTCAM_CALIBRATIONS__DIRECTORY": f"{directory}/calibrations",
        }
        with (
            daemon("--camera", CAMERA, environment=environment) as process,
            httpx.Client(base_url=process.url, timeout=600.0) as http,
        ):
            captured = dict(_answers(http))
        text = json.dumps(captured).replace(directory, _STATE).replace(process.url, _URL)
    for identifier, fixed in (
        (captured["RecordingDocument"]["id"], "20261120T081500Z-3f9c2a"),
        (captured["JobDocument"]["id"], "5a0c1f6be2d4"),
        (captured["CalibrationDocument"]["id"], "SIM-ideal-0-3f9c2a71b04e"),
    ):
        text = text.replace(identifier, fixed)
    found: dict[str, Any] = _fixed(json.loads(text), _FIXED)
    return found


def _answers(http: httpx.Client) -> Iterator[tuple[str, Any]]:
    """Yield what the daemon answers, by the name of the document."""
    api = "/api/v1"

    def get(path: str) -> Any:
        return http.get(path).raise_for_status().json()

    def post(path: str, body: Any) -> Any:
        return http.post(path, json=body).raise_for_status().json()

    def diffuser(before_lens: bool) -> None:
        changed = http.put(f"{api}/simulation", json={"diffuser": before_lens})
        changed.raise_for_status()

    def until(path: str, states: tuple[str, ...]) -> Any:
        while (document := get(path))["state"] not in states:
            time.sleep(_POLL_S)
        return document

    yield "LivenessDocument", get("/livez")
    yield "VersionsDocument", get("/api/versions")
    yield "FrameDocument", _computed(http)
    yield "ReadinessDocument", get("/readyz")
    yield "PixelDocument", get(f"{api}/frames/latest/pixel?x=80&y=60&bins=4")
    for name, path in (
        ("InfoDocument", "info"),
        ("CameraDocument", "camera"),
        ("CameraChoicesDocument", "camera/choices"),
        ("AcquisitionDocument", "acquisition"),
        ("ReconstructionDocument", "reconstruction"),
        ("HistoryDocument", "frames"),
        ("SimulationDocument", "simulation"),
        ("ExplanationDocument", "simulation/explain"),
        ("TradeoffDocument", "tradeoff"),
    ):
        yield name, get(f"{api}/{path}")
    yield "NeighboursDocument", _announced(http)
    yield "PlanDocument", post(f"{api}/plan", {"target": {"range_error_m": 0.005}})
    parameters = get(f"{api}/parameters")
    yield "ParametersDocument", parameters
    yield "ParameterDocument", parameters["parameters"][0]
    applied = get(f"{api}/sequence")
    yield "AppliedDocument", applied
    yield "SequenceDocument", {name: applied[name] for name in SequenceDocument.model_fields}

    diffuser(True)
    job = post(f"{api}/calibrations", {"name": "after warm-up", "frames": 2, "activate": True})
    yield "JobDocument", until(f"{api}/jobs/{job['id']}", ("done", "failed"))
    yield "JobsDocument", get(f"{api}/jobs")
    diffuser(False)
    _computed(http)  # so that the drift is judged
    calibrations = get(f"{api}/calibrations")
    yield "CalibrationsDocument", calibrations
    yield "CalibrationDocument", calibrations["calibrations"][0]
    yield "ActiveDocument", get(f"{api}/calibrations/active")

    recording = f"{api}/recordings/{post(f'{api}/recordings', _RECORDING)['id']}"
    yield "RecordingDocument", until(recording, ("complete",))
    yield "RecordingsDocument", get(f"{api}/recordings")
    yield "TimelineDocument", get(f"{recording}/frames")
    found = get(f"{api}/recordings")
    file = Path(found["directory"], found["recordings"][0]["id"] + ".h5")
    reconstruct = ["reconstruct", str(file), "--product", "range", "--json"]
    assert run([*reconstruct, "-o", str(file.with_suffix(".zarr"))]) == 0
    yield "ProductStoresDocument", get(f"{api}/products")

    yield "GrantedLeaseDocument", post(f"{api}/lease", {"holder": "alignment on bench 2"})
    yield "LeaseDocument", get(f"{api}/lease")


def _computed(http: httpx.Client) -> Any:
    """Have the range of a new frame computed; return what is known of that frame."""
    latest = http.get("/api/v1/frames").raise_for_status().json()["last"] or 0
    answer = http.get(
        "/api/v1/frames/latest/range.npy", params={"wait_s": 10.0, "after": latest}
    ).raise_for_status()
    return json.loads(answer.headers["Transientcam-Meta"])


def _announced(http: httpx.Client) -> Any:
    """Return what this daemon finds on the network, of which only itself is the same everywhere."""
    while True:
        document = http.get("/api/v1/cameras").raise_for_status().json()
        own = [
            each for each in document["cameras"] if each["url"] == str(http.base_url).rstrip("/")
        ]
        if own:
            return document | {"cameras": own, "left_out": 0}


def _fixed(value: Any, fields: Any) -> Any:
    """Return a value as it stands in the examples; ``fields`` as `_FIXED`."""
    match value:
        case dict():
            return {name: _field(name, each, fields) for name, each in value.items()}
        case [dict(), *_]:
            return [_fixed(each, fields) for each in value[:_KEPT]]
        case list():
            return [_fixed(each, fields) for each in value]
        case float():
            return float(f"{value:.{_DIGITS}g}")
        case _:
            return value


def _field(name: str, value: Any, fields: dict[str, Any]) -> Any:
    fixed = fields.get(name)
    if isinstance(value, dict | list) and isinstance(fixed, dict):
        return _fixed(value, fields | fixed)
    if fixed is None or value is None or isinstance(fixed, dict):
        return _fixed(value, fields)
    return fixed


def main() -> None:
    """Write the examples, or print which of them are old."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write what differs")
    write = parser.parse_args().write
    found, former = examples(), json.loads(EXAMPLES_FILE.read_text(encoding="utf-8"))
    for name in sorted(found.keys() | former.keys()):
        if found.get(name) != former.get(name):
            print(f"{'wrote' if write else 'old'}: {name}")
    if write:
        text = json.dumps(found, indent=1, ensure_ascii=False)
        EXAMPLES_FILE.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
