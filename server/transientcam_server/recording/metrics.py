"""What Prometheus may know of recordings."""

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from transientcam_server.recording.library import Library


class RecordingCollector(Collector):
    """Reads what a library counts anyway."""

    def __init__(self, library: Library) -> None:
        self._library = library

    def describe(self) -> Iterator[Metric]:
        """Name nothing in advance: there is one of these in a registry."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """Return the values of this moment."""
        totals = self._library.totals
        yield GaugeMetricFamily(
            "transientcam_recording_active",
            "Whether frames are being recorded.",
            self._library.active_id is not None,
        )
        yield CounterMetricFamily(
            "transientcam_recording_frames", "Frames that were recorded.", totals.frames
        )
        yield CounterMetricFamily(
            "transientcam_recording_dropped_frames",
            "Frames that the disk was too slow for.",
            totals.dropped_frames,
        )
        yield CounterMetricFamily(
            "transientcam_recording_bytes", "Bytes that were written.", totals.size_bytes
        )
        ended = CounterMetricFamily(
            "transientcam_recordings_ended", "Recordings, by why they ended.", labels=("reason",)
        )
        for reason, count in totals.ended.items():
            ended.add_metric((reason,), count)
        yield ended
        free_bytes = self._library.free_bytes()
        if free_bytes is not None:
            yield GaugeMetricFamily(
                "transientcam_recording_disk_free_bytes",
                "What the disk has left where recordings are kept.",
                free_bytes,
            )
