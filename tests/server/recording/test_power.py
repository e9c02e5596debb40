"""What the power takes away of a recording."""

import random
import shutil
from pathlib import Path

import pytest

from tests.server.recording.made import assert_same, frame, header
from tests.server.recording.power import DISKS, Event, Stated, Write, cut, moments, traced
from transientcam_server.errors import NotARecording
from transientcam_server.recording import Recording, RecordingWriter, recover
from transientcam_server.recording._seal import sealed_frames

FRAMES = 22
CUTS = 2


@pytest.fixture(scope="module")
def events(tmp_path_factory: pytest.TempPathFactory) -> list[Event]:
    """What a writer does to its file."""
    if shutil.which("strace") is None:
        pytest.skip("strace is not installed")
    return traced(tmp_path_factory.mktemp("traced") / "a.h5", frames=FRAMES)


@pytest.mark.parametrize("disk", DISKS)
def test_no_frame_of_more_than_a_second_ago_is_lost_in_a_power_cut(
    events: list[Event], disk: str, tmp_path: Path
) -> None:
    for number in range(CUTS):
        draw = random.Random(f"{disk} {number}")
        part = tmp_path / f"{number}.h5.part"
        found = cut(events, draw.choice(moments(events)), DISKS[disk], draw)
        part.write_bytes(found.content)

        with Recording(recover(part)) as recording:
            assert recording.frames >= found.must_be_there
            for index, raw in enumerate(recording):
                assert_same(raw, frame(index))


def test_frames_that_are_stated_to_be_on_the_disk_are_more_and_more(events: list[Event]) -> None:
    stated = [event.frames for event in events if isinstance(event, Stated)]

    assert stated == sorted(stated)
    assert 0 < stated[0] < stated[-1] <= FRAMES
    for at, event in enumerate(events):
        if isinstance(event, Stated):
            found = cut(events, at + 1, DISKS["nothing"], random.Random(0))
            assert found.stated == event.frames <= found.acknowledged


def test_what_was_written_is_all_that_the_file_holds(events: list[Event], tmp_path: Path) -> None:
    written = cut(events, moments(events)[-1], DISKS["everything"], random.Random(0))

    assert sum(isinstance(event, Write) for event in events) > FRAMES
    part = tmp_path / "a.h5.part"
    part.write_bytes(written.content)
    assert written.acknowledged == FRAMES
    assert len(sealed_frames(part)) == FRAMES


def test_frames_are_found_although_no_index_can_be_read(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    for number in range(3):
        writer.append(frame(number))
    data = bytearray(writer.part.read_bytes())
    writer.close({})
    at = data.find(b"OHDR", 1000)
    while at >= 0:  # of every dataset
        data[at + 20] ^= 1
        at = data.find(b"OHDR", at + 1)
    part = tmp_path / "b.h5.part"
    part.write_bytes(data)

    with pytest.raises(NotARecording):
        Recording(part)
    assert len(sealed_frames(part)) == 3


def test_a_frame_that_is_not_whole_ends_what_is_found(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    for number in range(4):
        writer.append(frame(number))
    data = bytearray(writer.part.read_bytes())
    writer.close({})
    data[sealed_frames(writer.path)[2].offset + 100] ^= 1
    part = tmp_path / "b.h5.part"
    part.write_bytes(data)

    with Recording(recover(part)) as recording:
        assert [raw.number for raw in recording] == [0, 1]
