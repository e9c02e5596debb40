"""The contents of a scrape, and that it stays small."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.server.streaming import streaming
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import wire
from transientcam_driver import RawFrame
from transientcam_server.api._metrics import Metrics
from transientcam_server.camera import CameraLostEvent, Captured

Samples = dict[str, float]


def scrape(http: httpx.Client) -> Samples:
    """Return every sample by its name and labels."""
    response = http.get("/metrics")
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/plain; version=")
    samples: Samples = {}
    for family in text_string_to_metric_families(response.text):
        assert family.documentation, family.name
        for sample in family.samples:
            labels = ",".join(f"{key}={value}" for key, value in sorted(sample.labels.items()))
            samples[f"{sample.name}{{{labels}}}" if labels else sample.name] = sample.value
    return samples


def test_frames_clients_and_latency_are_counted(served: Served, http: httpx.Client) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("range")
        for _ in range(4):
            client.frame()
        samples = scrape(http)

    assert samples["transientcam_stream_clients"] == 1
    assert samples["transientcam_frames_captured_total"] >= 3
    assert samples["transientcam_frame_latency_seconds_count"] >= 2
    assert samples["transientcam_frame_latency_seconds_sum"] > 0.0
    assert samples["transientcam_frame_interval_seconds_count"] >= 2
    assert samples["transientcam_reconstruction_duration_seconds_count"] >= 1
    assert samples["transientcam_images_total{result=received}"] >= 3 * 16
    assert samples["transientcam_device_connected"] == 1
    assert samples["transientcam_acquisition_running"] == 1
    assert 0.0 <= samples["transientcam_pixels_flagged_ratio{flag=biased}"] <= 1.0
    assert samples["transientcam_http_requests_total{status=5xx}"] == 0


def test_the_memory_of_former_frames_is_reported_with_its_limit(
    served: Served, http: httpx.Client
) -> None:
    http.get("/api/v1/frames/3", params={"wait_s": 10.0})
    http.put("/api/v1/acquisition", json={"running": False})

    samples, frames = scrape(http), http.get("/api/v1/frames").json()

    assert samples["transientcam_history_frames"] == frames["count"] >= 3
    assert samples["transientcam_history_bytes"] == frames["bytes"]
    assert samples["transientcam_history_limit_bytes"] == 256 * 1024**2
    assert samples["transientcam_preview_clients"] == 0


def test_recordings_are_counted_with_why_they_ended(tmp_path: Path) -> None:
    kept = {"directory": tmp_path, "min_free_bytes": 0}
    with serving(recordings=kept) as daemon, httpx.Client(base_url=daemon.url, timeout=60) as http:
        before = scrape(http)
        first = http.post("/api/v1/recordings", json={"frames": 2}).json()["id"]
        wait_until(lambda: http.get(f"/api/v1/recordings/{first}").json()["state"] == "complete")
        second = http.post("/api/v1/recordings", json={}).json()["id"]
        during = scrape(http)
        stopped = http.post(f"/api/v1/recordings/{second}/stop").json()
        after = scrape(http)

    prefix = "transientcam_recording"
    assert f"{prefix}_disk_free_bytes" in before
    assert [each[f"{prefix}_active"] for each in (before, during, after)] == [0, 1, 0]
    assert before[f"{prefix}s_ended_total{{reason=frames}}"] == 0
    assert after[f"{prefix}s_ended_total{{reason=frames}}"] == 1
    assert after[f"{prefix}s_ended_total{{reason=stopped}}"] == 1
    assert after[f"{prefix}_frames_total"] == 2 + stopped["frames"]
    assert after[f"{prefix}_bytes_total"] >= during[f"{prefix}_bytes_total"] > 0
    assert after[f"{prefix}_dropped_frames_total"] == 0


def test_intervals_are_those_of_the_camera_s_clock_within_one_sequence(served: Served) -> None:
    metrics = Metrics(served.service)
    for epoch, time_s in ((1, 0.0), (1, 0.1), (1, 0.3), (2, 9.0), (2, 9.25)):
        raw = cast("RawFrame", SimpleNamespace(epoch=epoch, device_time_s=time_s))
        metrics.happened(Captured(raw, served.service.applied))
    metrics.happened(CameraLostEvent("unplugged"))
    metrics.happened(Captured(raw, served.service.applied))

    def sample(name: str) -> float | None:
        return metrics.registry.get_sample_value(f"transientcam_frame_interval_seconds_{name}")

    assert sample("count") == 3
    assert sample("sum") == pytest.approx(0.1 + 0.2 + 0.25)


def test_a_loss_and_a_return_are_counted(served: Served, http: httpx.Client) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        client.frame()
        http.post("/api/v1/simulation/faults", json={"fault": "unplug"})
        client.notice("camera-lost")
        lost = scrape(http)
        http.post("/api/v1/simulation/faults", json={"fault": "replug"})
        client.notice("camera-back")
        back = scrape(http)

    assert (lost["transientcam_device_connected"], back["transientcam_device_connected"]) == (0, 1)
    assert lost["transientcam_device_losses_total"] == 1
    assert lost["transientcam_device_reconnects_total"] == 0
    assert back["transientcam_device_reconnects_total"] == 1


def test_frames_that_a_client_was_too_slow_for_are_counted(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as slow:
        slow.subscribe("range", credits=1)
        first = slow.frame()
        http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": first.frame + 3})
        dropped = scrape(http)["transientcam_frames_dropped_total"]
        slow.send(wire.Ack(first.frame).to_document())
        notice = slow.notice("dropped")

    assert dropped >= 1
    assert notice.details["count"] >= dropped


def test_requests_are_counted_by_class(served: Served, http: httpx.Client) -> None:
    before = scrape(http)
    http.get("/api/v1/nothing")
    http.get("/livez")
    after = scrape(http)

    def grown(status: str) -> float:
        name = f"transientcam_http_requests_total{{status={status}}}"
        return after[name] - before[name]

    assert grown("4xx") == 1
    assert grown("2xx") == 2  # and the first scrape


def test_the_number_of_series_does_not_grow_with_the_clients(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as first:
        first.subscribe("flags")
        first.frame()
        before = set(scrape(http))
        with streaming(served.stream_url) as second:
            second.subscribe("flags", "range", "direct")
            second.frame()
            http.get("/api/v1/frames/latest/flags.npy")
            after = set(scrape(http))

    assert after == before


def test_two_services_in_one_process_have_metrics_of_their_own(served: Served) -> None:
    assert Metrics(served.service).registry is not served.app.state.metrics.registry
