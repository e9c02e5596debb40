"""What Prometheus reads of a service: few series, whatever the number of clients.

What the service counts anyway is read at each scrape; only distributions are observed as
they happen. Each service has a registry of its own.
"""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import prometheus_client as prometheus
from prometheus_client import Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, InfoMetricFamily, Metric
from prometheus_client.registry import Collector

import transientcam_moments as tm
from transientcam_server.camera import CameraLostEvent, CameraRecoveredEvent, Captured, Event
from transientcam_server.imaging import NOMINAL_ID
from transientcam_server.service import Service

CONTENT_TYPE: Final = prometheus.CONTENT_TYPE_LATEST
_FLAGS: Final = [str(flag.name).lower() for flag in tm.Flags if flag]
_INTERVALS_S: Final = (0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
_LATENCIES_S: Final = (0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)
_COMPUTING_S: Final = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)


class Metrics:
    """The metrics of one service."""

    def __init__(self, service: Service) -> None:
        self.registry = prometheus.CollectorRegistry()
        self._frame_interval = Histogram(
            "transientcam_frame_interval_seconds",
            "From one frame to the next, by the camera's clock.",
            buckets=_INTERVALS_S,
            registry=self.registry,
        )
        self._latency = Histogram(
            "transientcam_frame_latency_seconds",
            "From the arrival of a frame's last image until a product of it left for a client.",
            buckets=_LATENCIES_S,
            registry=self.registry,
        )
        self._reconstruction = Histogram(
            "transientcam_reconstruction_duration_seconds",
            "Computing time of a frame of which anything was computed.",
            buckets=_COMPUTING_S,
            registry=self.registry,
        )
        self._requests = prometheus.Counter(
            "transientcam_http_requests",
            "Requests that were answered, by the class of the answer's status.",
            ("status",),
            registry=self.registry,
        )
        for each in ("2xx", "3xx", "4xx", "5xx"):
            self._requests.labels(each)
        self._last: Captured | None = None
        # every series from the start, so that its rate can be queried
        self.pixels: Mapping[str, int] = {"total": 1} | dict.fromkeys(_FLAGS, 0)
        self.corrupt: dict[str, int] = dict.fromkeys(
            ("rejected", "repaired", "filled", "unrepaired"), 0
        )
        self.losses = 0
        self.reconnects = 0
        self.registry.register(_ServiceCollector(service, self))
        prometheus.ProcessCollector(registry=self.registry)
        prometheus.PlatformCollector(registry=self.registry)
        prometheus.GCCollector(registry=self.registry)

    def happened(self, event: Event) -> None:
        """Count an event of the acquisition."""
        match event:
            case Captured(raw):
                if self._last is not None and self._last.raw.epoch == raw.epoch:
                    interval_s = raw.device_time_s - self._last.raw.device_time_s
                    self._frame_interval.observe(interval_s)
                self._last = event
            case CameraLostEvent():
                self.losses += 1
                self._last = None
            case CameraRecoveredEvent():
                self.reconnects += 1

    def sent(self, latency_s: float) -> None:
        """Observe how old a frame was when it left for a client."""
        self._latency.observe(latency_s)

    def superseded(self, meta: Mapping[str, Any]) -> None:
        """Count a frame that is no longer the newest by what became of it."""
        if meta["reconstruct_s"] is not None:
            self._reconstruction.observe(meta["reconstruct_s"])
        self.pixels = meta["pixels"] or self.pixels
        for result in self.corrupt:
            images = meta[f"{result}_images"] or 0
            self.corrupt[result] += len(images) if isinstance(images, list) else images

    def answered(self, status: int) -> None:
        """Count an answer."""
        self._requests.labels(f"{status // 100}xx").inc()

    def exposition(self) -> bytes:
        """Return everything in the text format of Prometheus."""
        return prometheus.generate_latest(self.registry)


_SERIES: Final = tomllib.loads(Path(__file__).with_name("metrics.toml").read_text("utf-8"))


class _ServiceCollector(Collector):
    """Collects what the service counts anyway."""

    def __init__(self, service: Service, metrics: Metrics) -> None:
        self._service = service
        self._metrics = metrics

    def collect(self) -> Iterator[Metric]:
        """Return the values of this moment; no series of what there is not."""
        capabilities = self._service.camera.capabilities
        versions = {"version": self._service.identity["version"], "api": "v1"}
        versions |= {"model": capabilities.model, "firmware": capabilities.firmware}
        yield InfoMetricFamily("transientcam_build", "Versions of what runs here.", value=versions)
        values = self._of_camera() | self._of_frames() | self._of_clients() | self._of_relay()
        for name, series in _SERIES.items():
            if (value := values.get(name)) is not None:
                family, told = _FAMILIES[series["kind"]], (series["meaning"], value)
                yield _filled(family, f"transientcam_{name}", *told, series.get("label", ""))

    def _of_camera(self) -> "_Values":
        status, counters = self._service.acquisition.status(), self._service.camera.counters
        images = {"received": counters.images, "lost": counters.lost, "corrupt": counters.corrupt}
        calibrations, device = self._service.calibrations, tm.kernels.device_state()
        drift = calibrations.known_drift
        return {
            "device_connected": status.state != "lost",
            "acquisition_running": status.state == "streaming",
            "device_losses": self._metrics.losses,
            "device_reconnects": self._metrics.reconnects,
            "images": images,
            "spoilt_images": self._metrics.corrupt,
            "usb_resynchronisations": counters.resyncs,
            "frames_captured": status.frames,
            "frame_age_seconds": status.frame_age_s,
            "device_results": None if device is None else device["results"],
            "calibration_active": calibrations.active_id != NOMINAL_ID,
            "calibration_timestamp_seconds": calibrations.active_since_s,
            "calibration_invalid_pixels_ratio": None if drift is None else drift.invalid_share,
        }

    def _of_frames(self) -> "_Values":
        history, latest = self._service.history, self._service.hub.latest
        values: _Values = {
            "history_frames": history.count,
            "history_bytes": history.size_bytes,
            "history_limit_bytes": history.settings.max_bytes,
        }
        if latest is None:
            return values
        pixels = self._metrics.pixels
        flagged = {
            flag: n / pixels["total"] for flag, n in pixels.items() if flag not in _UNFLAGGED
        }
        temperature_c = latest.raw.temperature_c
        return values | {
            "sensor_temperature_celsius": temperature_c,
            "pixels_flagged_ratio": flagged,
        }

    def _of_clients(self) -> "_Values":
        hub, library = self._service.hub, self._service.recordings
        totals = library.totals
        return {
            "stream_clients": hub.clients,
            "preview_clients": self._service.mjpeg_clients,
            "frames_dropped": hub.dropped,
            "lease_held": self._service.lease.current is not None,
            "recording_active": library.active_id is not None,
            "recording_frames": totals.frames,
            "recording_dropped_frames": totals.dropped_frames,
            "recording_bytes": totals.size_bytes,
            "recordings_ended": totals.ended,
            "disk_waiting_seconds": library.disk_waiting_s,
            "recording_disk_free_bytes": library.known_free_bytes,
        }

    def _of_relay(self) -> "_Values":
        relay, latest = self._service.relay, self._service.hub.latest
        if relay is None:
            return {}
        hops = {} if latest is None else {str(k): hop for k, hop in enumerate(latest.raw.hops, 1)}
        return {
            "relay_reconnects": relay.relayed.reconnects,
            "relay_origin_restarts": relay.relayed.restarts,
            "relay_dropped_frames": relay.relayed.dropped_frames,
            "relay_hop_latency_seconds": {k: hop.latency_s for k, hop in hops.items()},
            "relay_hop_missed_frames": {k: hop.missed_frames for k, hop in hops.items()},
        }


_Values = dict[str, float | Mapping[str, float] | None]
_UNFLAGGED: Final = ("total", "valid")
_FAMILIES: Final = {"gauge": GaugeMetricFamily, "counter": CounterMetricFamily}


def _filled(
    family: type[GaugeMetricFamily | CounterMetricFamily],
    name: str,
    meaning: str,
    value: float | Mapping[str, float],
    label: str,
) -> Metric:
    """Return a value; several of them, each with its value of the label."""
    if not isinstance(value, Mapping):
        return family(name, meaning, value)
    metric = family(name, meaning, labels=(label,))
    for each, number in value.items():
        metric.add_metric((each,), number)
    return metric
