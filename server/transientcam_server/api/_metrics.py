"""What Prometheus reads of a service: few series, whatever the number of clients.

What the service counts anyway is read at each scrape; only distributions are observed as
they happen. Each service has a registry of its own.
"""

from collections.abc import Iterator, Mapping
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


class _ServiceCollector(Collector):
    """Collects what the service counts anyway."""

    def __init__(self, service: Service, metrics: Metrics) -> None:
        self._service = service
        self._metrics = metrics

    def collect(self) -> Iterator[Metric]:
        """Return the values of this moment."""
        yield from self._build()
        yield from self._device()
        yield from self._frames()
        yield from self._history()
        yield from self._calibration()
        yield from self._clients()
        yield from self._recordings()
        yield from self._relay()

    def _build(self) -> Iterator[Metric]:
        capabilities = self._service.camera.capabilities
        versions = {
            "version": self._service.identity["version"],
            "api": "v1",
            "model": capabilities.model,
            "firmware": capabilities.firmware,
        }
        yield InfoMetricFamily("transientcam_build", "Versions of what runs here.", value=versions)

    def _device(self) -> Iterator[Metric]:
        state = self._service.acquisition.status().state
        yield _gauge("device_connected", "Whether the camera answers.", state != "lost")
        yield _gauge(
            "acquisition_running", "Whether frames are being captured.", state == "streaming"
        )
        yield _counter("device_losses", "How often the camera was lost.", self._metrics.losses)
        yield _counter(
            "device_reconnects", "How often a lost camera came back.", self._metrics.reconnects
        )
        counters = self._service.camera.counters
        yield _counter(
            "images",
            "Images from the camera, by what became of them.",
            {"received": counters.images, "lost": counters.lost, "corrupt": counters.corrupt},
            by="result",
        )
        yield _counter(
            "spoilt_images",
            "Images unlike the others, of frames that were computed, by what became of them.",
            self._metrics.corrupt,
            by="result",
        )
        yield _counter(
            "usb_resynchronisations",
            "How often the beginning of an image had to be searched for.",
            counters.resyncs,
        )

    def _frames(self) -> Iterator[Metric]:
        status = self._service.acquisition.status()
        yield _counter("frames_captured", "Frames since the service started.", status.frames)
        yield _gauge("frame_age_seconds", "Since the last frame arrived.", status.frame_age_s)
        if (device := tm.kernels.device_state()) is not None:
            yield _counter(
                "device_results",
                "Passes and likelihoods that a GPU was asked for, by what computed them.",
                device["results"],
                by="device",
            )
        latest = self._service.hub.latest
        if latest is None:
            return
        if (temperature_c := latest.raw.temperature_c) is not None:
            yield _gauge(
                "sensor_temperature_celsius", "Of the camera, with its last frame.", temperature_c
            )
        pixels = self._metrics.pixels
        yield _gauge(
            "pixels_flagged_ratio",
            "Share of the pixels of the last frame that was looked at that carry a flag.",
            {
                flag: count / pixels["total"]
                for flag, count in pixels.items()
                if flag not in ("total", "valid")
            },
            by="flag",
        )

    def _history(self) -> Iterator[Metric]:
        history = self._service.history
        yield _gauge("history_frames", "Former frames that can still be had.", history.count)
        yield _gauge("history_bytes", "Memory of their raw images.", history.size_bytes)
        yield _gauge("history_limit_bytes", "What it may be at most.", history.settings.max_bytes)

    def _calibration(self) -> Iterator[Metric]:
        calibrations = self._service.calibrations
        yield _gauge(
            "calibration_active",
            "Whether a measurement calibrates frames, where it fits the sequence.",
            calibrations.active_id != NOMINAL_ID,
        )
        if (captured_unix_s := calibrations.active_since_s) is not None:
            yield _gauge(
                "calibration_timestamp_seconds",
                "When the active calibration was measured.",
                captured_unix_s,
            )
        if (drift := calibrations.known_drift) is not None:
            yield _gauge(
                "calibration_invalid_pixels_ratio",
                "Share of pixels whose moments contradict each other by more than noise explains.",
                drift.invalid_share,
            )

    def _clients(self) -> Iterator[Metric]:
        hub = self._service.hub
        lease = self._service.lease.current
        yield _gauge("stream_clients", "Streams open now.", hub.clients)
        yield _gauge(
            "preview_clients",
            "Clients that receive a preview as MJPEG now.",
            self._service.mjpeg_clients,
        )
        yield _counter(
            "frames_dropped",
            "Frames that clients were too slow for, of all clients together.",
            hub.dropped,
        )
        yield _gauge("lease_held", "Whether a client holds the lease.", lease is not None)

    def _recordings(self) -> Iterator[Metric]:
        library, totals = self._service.recordings, self._service.recordings.totals
        yield _gauge(
            "recording_active", "Whether frames are being recorded.", library.active_id is not None
        )
        yield _counter("recording_frames", "Frames that were recorded.", totals.frames)
        yield _counter(
            "recording_dropped_frames",
            "Frames that the disk was too slow for.",
            totals.dropped_frames,
        )
        yield _counter("recording_bytes", "Bytes that were written.", totals.size_bytes)
        yield _counter(
            "recordings_ended", "Recordings, by why they ended.", totals.ended, by="reason"
        )
        yield _gauge(
            "disk_waiting_seconds",
            "How long the disk of the recordings has not answered.",
            library.disk_waiting_s,
        )
        if (free_bytes := library.known_free_bytes) is not None:
            yield _gauge(
                "recording_disk_free_bytes",
                "What the disk has left where recordings are kept.",
                free_bytes,
            )

    def _relay(self) -> Iterator[Metric]:
        relay = self._service.relay
        if relay is None:
            return
        counters = relay.relayed
        yield _counter(
            "relay_reconnects", "How often the origin was found again.", counters.reconnects
        )
        yield _counter(
            "relay_origin_restarts",
            "How often the origin was started anew meanwhile.",
            counters.restarts,
        )
        yield _counter(
            "relay_dropped_frames",
            "Frames that the origin dropped because relay or network were too slow.",
            counters.dropped_frames,
        )
        latest = self._service.hub.latest
        hops = {} if latest is None else {str(k): hop for k, hop in enumerate(latest.raw.hops, 1)}
        yield _gauge(
            "relay_hop_latency_seconds",
            "From the arrival of the last frame at the service before to that at the relay, by "
            "both clocks; hop 1 is the nearest to the camera.",
            {number: hop.latency_s for number, hop in hops.items()},
            by="hop",
        )
        yield _counter(
            "relay_hop_missed_frames",
            "Frames that a relay never got of the service before it.",
            {number: hop.missed_frames for number, hop in hops.items()},
            by="hop",
        )


def _gauge(name: str, meaning: str, value: float | Mapping[str, float], by: str = "") -> Metric:
    """Return a value that rises and falls; several of them, each with its value of a label."""
    return _filled(GaugeMetricFamily, name, meaning, value, by)


def _counter(name: str, meaning: str, value: float | Mapping[str, float], by: str = "") -> Metric:
    """Return a value that only rises; several of them, each with its value of a label."""
    return _filled(CounterMetricFamily, name, meaning, value, by)


def _filled(
    family: type[GaugeMetricFamily | CounterMetricFamily],
    name: str,
    meaning: str,
    value: float | Mapping[str, float],
    by: str,
) -> Metric:
    full_name = f"transientcam_{name}"
    if not isinstance(value, Mapping):
        return family(full_name, meaning, value)
    metric = family(full_name, meaning, labels=(by,))
    for label, each in value.items():
        metric.add_metric((label,), each)
    return metric
