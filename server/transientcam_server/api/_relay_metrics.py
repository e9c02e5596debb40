"""What Prometheus reads of a relay; nothing of a service that has its camera itself."""

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from transientcam_server.service import Service


class RelayCollector(Collector):
    """Collects what a relay counts anyway, and the hops of the last frame."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def describe(self) -> Iterator[Metric]:
        """Describe no metrics in advance: a registry has one such collector."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """Return the values of this moment."""
        relay = self._service.relay
        if relay is None:
            return
        counters = relay.relayed
        yield CounterMetricFamily(
            "transientcam_relay_reconnects",
            "How often the origin was found again.",
            counters.reconnects,
        )
        yield CounterMetricFamily(
            "transientcam_relay_origin_restarts",
            "How often the origin was started anew meanwhile.",
            counters.restarts,
        )
        yield CounterMetricFamily(
            "transientcam_relay_dropped_frames",
            "Frames that the origin dropped because relay or network were too slow.",
            counters.dropped_frames,
        )
        yield from self._hops()

    def _hops(self) -> Iterator[Metric]:
        latest = self._service.hub.latest
        latency = GaugeMetricFamily(
            "transientcam_relay_hop_latency_seconds",
            "From the arrival of the last frame at the service before to that at the relay, by "
            "both clocks; hop 1 is the nearest to the camera.",
            labels=("hop",),
        )
        missed = CounterMetricFamily(
            "transientcam_relay_hop_missed_frames",
            "Frames that a relay never got of the service before it.",
            labels=("hop",),
        )
        for number, hop in enumerate(() if latest is None else latest.raw.hops, 1):
            latency.add_metric((str(number),), hop.latency_s)
            missed.add_metric((str(number),), hop.missed_frames)
        yield latency
        yield missed
