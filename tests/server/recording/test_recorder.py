import errno
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.server.recording.made import APPLIED, CAPABILITIES, assert_same, frame, header
from tests.server.recording.test_recovery import limited_files
from transientcam_driver import Sequence
from transientcam_server.recording import Limits, Recording, RecordingWriter, recover
from transientcam_server.recording._recorder import Progress, Recorder, Totals

PATIENCE_S = 60.0
PLENTY = 10**15
Start = Callable[..., Recorder]


class GatedWriter(RecordingWriter):
    """A disk that takes nothing until it is let."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self.gate = threading.Event()
        self.waiting = threading.Event()
        self.error: OSError | None = None

    def append(self, *arguments: Any, **keywords: Any) -> None:
        self.waiting.set()
        assert self.gate.wait(PATIENCE_S)
        if self.error is not None:
            raise self.error
        super().append(*arguments, **keywords)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts recorders into a.h5, and ends them with the test."""
    started: list[Recorder] = []

    def begin(
        writer: RecordingWriter | None = None,
        *,
        limits: Limits | None = None,
        queue_frames: int = 8,
        **more: Any,
    ) -> Recorder:
        recorder = Recorder(
            writer or RecordingWriter(tmp_path / "a.h5", header()),
            header(),
            limits=limits or Limits(),
            queue_frames=queue_frames,
            **{"free_bytes": lambda: PLENTY, **more},
        )
        recorder.start()
        started.append(recorder)
        return recorder

    yield begin
    for recorder in started:
        recorder.stop()


def test_what_is_offered_before_the_stop_is_in_the_file(start: Start, tmp_path: Path) -> None:
    recorder = start()
    for number in range(6):
        recorder.offer(frame(number), APPLIED)
    recorder.stop()
    recorder.offer(frame(6), APPLIED)

    assert recorder.wait(PATIENCE_S)
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 6
        assert recording.end["reason"] == "stopped"
        assert recording.end["frames"] == 6
        assert_same(recording.frame(5), frame(5))


def test_frames_of_the_past_come_first_and_none_comes_twice(start: Start, tmp_path: Path) -> None:
    recorder = start(awaits_past=True)
    captured = [frame(number) for number in range(8)]
    for raw in captured[5:]:  # while its past is still being looked for
        recorder.offer(raw, APPLIED)

    count = recorder.precede([(raw, APPLIED) for raw in captured[2:7]])
    recorder.stop()

    assert count == 3
    assert recorder.wait(PATIENCE_S)
    with Recording(tmp_path / "a.h5") as recording:
        assert [raw.number for raw in recording] == [2, 3, 4, 5, 6, 7]
        assert_same(recording.frame(0), captured[2])
        assert recording.series("dropped_frames").tolist() == [0] * 6


def test_frames_of_another_sequence_are_no_past(start: Start, tmp_path: Path) -> None:
    recorder = start(awaits_past=True)
    other = replace(APPLIED, sequence=Sequence(harmonics=9))

    count = recorder.precede([(frame(0), other), (frame(1), APPLIED)])
    recorder.stop()

    assert count == 1
    assert recorder.wait(PATIENCE_S)
    with Recording(tmp_path / "a.h5") as recording:
        assert [raw.number for raw in recording] == [1]


def test_its_past_belongs_to_how_long_it_lasts(start: Start, tmp_path: Path) -> None:
    recorder = start(awaits_past=True, limits=Limits(duration_s=1000.0))
    began_s = header().started_s
    past = [(replace(frame(0), host_time_s=began_s - 2000.0), APPLIED)]

    recorder.precede(past)
    recorder.offer(frame(1), APPLIED)
    duration_s = recorder.progress.duration_s
    reason = recorder.progress.reason
    recorder.stop()

    assert recorder.wait(PATIENCE_S)
    assert duration_s >= 2000.0
    assert reason is None  # the limit counts from now on
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.end["duration_s"] >= 2000.0


def test_one_that_is_stopped_before_its_past_is_known_ends(start: Start, tmp_path: Path) -> None:
    recorder = start(awaits_past=True)
    recorder.offer(frame(3), APPLIED)
    recorder.stop()

    assert recorder.wait(PATIENCE_S)
    assert recorder.precede([(frame(1), APPLIED)]) == 0
    with Recording(tmp_path / "a.h5") as recording:
        assert [raw.number for raw in recording] == [3]


def test_a_slow_disk_costs_frames_and_never_the_camera(start: Start, tmp_path: Path) -> None:
    reported: list[tuple[int, int]] = []
    writer = GatedWriter(tmp_path / "a.h5", header())
    recorder = start(
        writer, queue_frames=3, on_dropped=lambda count, total: reported.append((count, total))
    )
    recorder.offer(frame(0), APPLIED)
    assert writer.waiting.wait(PATIENCE_S)
    for number in range(1, 9):  # three fit the queue; none of this waits for the disk
        recorder.offer(frame(number), APPLIED)
    assert recorder.progress.dropped_frames == 5
    writer.gate.set()
    while recorder.progress.frames < 4:
        assert not recorder.wait(0.01)
    recorder.offer(frame(9), APPLIED)
    recorder.stop()

    assert recorder.wait(PATIENCE_S)
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.series("device_frame").tolist() == [0, 1, 2, 3, 9]
        assert recording.series("dropped_frames").tolist() == [0, 0, 0, 0, 5]
        assert recording.end["dropped_frames"] == 5
    assert sum(count for count, _ in reported) == 5
    assert reported[-1][1] == 5


def test_it_ends_after_the_frames_wanted(start: Start, tmp_path: Path) -> None:
    recorder = start(limits=Limits(frames=3))
    for number in range(8):
        recorder.offer(frame(number), APPLIED)

    assert recorder.wait(PATIENCE_S)
    assert recorder.progress.reason == "frames"
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 3


def test_it_ends_after_the_time_wanted_also_without_a_frame(start: Start) -> None:
    now_s = [100.0]
    recorder = start(limits=Limits(duration_s=30.0), clock=lambda: now_s[0])
    assert not recorder.wait(0.5)

    now_s[0] = 130.0

    assert recorder.wait(PATIENCE_S)
    assert recorder.progress.reason == "duration"
    assert recorder.progress.duration_s == 30.0


def test_it_ends_before_the_file_outgrows_its_limit_by_more_than_a_frame(
    start: Start, tmp_path: Path
) -> None:
    recorder = start(limits=Limits(size_bytes=200_000), queue_frames=1000)
    for number in range(1000):
        recorder.offer(frame(number), APPLIED)

    assert recorder.wait(PATIENCE_S)
    assert recorder.progress.reason == "size"
    assert 200_000 <= (tmp_path / "a.h5").stat().st_size < 200_000 + 2 * frame(0).images.nbytes


def test_it_ends_while_the_disk_still_has_what_is_to_stay_free(start: Start) -> None:
    recorder = start(limits=Limits(free_bytes=1000), free_bytes=lambda: 999)

    assert recorder.wait(PATIENCE_S)
    assert recorder.progress.reason == "disk-space"


def test_another_sequence_ends_it(start: Start, tmp_path: Path) -> None:
    recorder = start()
    recorder.offer(frame(0), APPLIED)
    other = CAPABILITIES.apply(Sequence(harmonics=2, zeroth="estimated", exposure_s=2e-3), epoch=8)
    recorder.offer(frame(1), other)

    assert recorder.wait(PATIENCE_S)
    assert recorder.progress.reason == "sequence-changed"
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 1


def test_the_same_sequence_counted_anew_after_an_unplug_does_not(
    start: Start, tmp_path: Path
) -> None:
    recorder = start()
    recorder.offer(frame(0), APPLIED)
    recorder.offer(replace(frame(1), epoch=1), replace(APPLIED, epoch=1))
    recorder.stop()

    assert recorder.wait(PATIENCE_S)
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.series("epoch").tolist() == [APPLIED.epoch, 1]


def test_annotations_can_be_replaced_while_it_runs(start: Start, tmp_path: Path) -> None:
    recorder = start()
    assert recorder.annotate({"first": 1})
    recorder.offer(frame(0), APPLIED)
    assert recorder.annotate({"seen": "a fly"})
    recorder.offer(frame(1), APPLIED)
    recorder.stop()
    assert recorder.wait(PATIENCE_S)

    assert not recorder.annotate({"late": True})
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.annotations == {"seen": "a fly"}


def test_a_disk_that_fails_ends_it_with_the_reason_and_keeps_what_was_written(
    start: Start, tmp_path: Path
) -> None:
    writer = GatedWriter(tmp_path / "a.h5", header())
    writer.gate.set()
    ended: list[Recorder] = []
    recorder = start(writer, on_end=ended.append)
    for number in range(3):
        recorder.offer(frame(number), APPLIED)
    while recorder.progress.frames < 3:
        assert not recorder.wait(0.01)
    writer.error = OSError(errno.ENOSPC, "No space left on device")
    recorder.offer(frame(3), APPLIED)

    assert recorder.wait(PATIENCE_S)
    assert ended == [recorder]
    assert recorder.progress.reason == "failed"
    assert recorder.progress.problem is not None
    assert "No space left" in recorder.progress.problem
    recorder.offer(frame(4), APPLIED)  # the camera goes on
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 3
        assert recording.end["reason"] == "failed"


def test_a_disk_that_is_really_full_loses_no_frame_that_was_acknowledged(
    start: Start, tmp_path: Path
) -> None:
    with limited_files(300_000):
        recorder = start(queue_frames=1000)
        for number in range(200):
            recorder.offer(frame(number), APPLIED)
        assert recorder.wait(PATIENCE_S)
    acknowledged = recorder.progress.frames

    assert recorder.progress.reason == "failed"
    assert "File too large" in (recorder.progress.problem or "")
    assert acknowledged > 10
    # HDF5 could not even finish the file; recovery can
    with Recording(recover(tmp_path / "a.h5.part")) as recording:
        assert recording.frames == acknowledged
        assert_same(recording.frame(acknowledged - 1), frame(acknowledged - 1))


def test_totals_are_sums_over_recordings_and_count_why_they_ended() -> None:
    running = Progress(5, 0, 2, 700, 1.5, None, None, finished=False)
    stopped = replace(running, reason="stopped", finished=True)

    totals = Totals().with_running(running)

    assert (totals.frames, totals.dropped_frames, totals.size_bytes) == (5, 2, 700)
    assert set(totals.ended.values()) == {0}
    after = Totals(1, 10, 100).after(stopped).after(replace(stopped, reason=None))
    assert (after.frames, after.dropped_frames, after.size_bytes) == (11, 14, 1500)
    assert {reason: count for reason, count in after.ended.items() if count} == {
        "stopped": 1,
        "failed": 1,
    }


def test_what_was_dropped_is_told_once_a_second_and_in_all_at_the_end(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    now_s = [100.0]
    recorder = Recorder(
        RecordingWriter(tmp_path / "a.h5", header()),
        header(),
        limits=Limits(),
        queue_frames=1,
        free_bytes=lambda: PLENTY,
        on_dropped=lambda count, total: told.append((count, total)),
        clock=lambda: now_s[0],
    )

    def write(offered: int) -> None:
        for number in range(offered):
            recorder.offer(frame(number), APPLIED)
        recorder._step()

    write(3)  # of which one has room
    assert told == [(2, 2)]
    now_s[0] += 0.999
    write(4)
    assert told == [(2, 2)]
    now_s[0] += 0.001
    write(1)
    assert told == [(2, 2), (3, 5)]
    write(2)
    recorder.stop()
    recorder.start()
    assert recorder.wait(PATIENCE_S)
    assert told == [(2, 2), (3, 5), (1, 6)]
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.series("dropped_frames").tolist() == [0, 2, 3, 0]
        assert recording.end["dropped_frames"] == 6


@pytest.mark.parametrize(("free_bytes", "reason"), [(1000, None), (999, "disk-space")])
def test_it_ends_when_less_is_free_than_is_to_stay_so(
    tmp_path: Path, free_bytes: int, reason: str | None
) -> None:
    recorder = Recorder(
        RecordingWriter(tmp_path / "a.h5", header()),
        header(),
        limits=Limits(free_bytes=1000),
        queue_frames=8,
        free_bytes=lambda: free_bytes,
    )

    recorder.offer(frame(0), APPLIED)
    recorder._step()

    assert recorder.progress.reason == reason
    recorder.stop()
    recorder.start()
    assert recorder.wait(PATIENCE_S)
