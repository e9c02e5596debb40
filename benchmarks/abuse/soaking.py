"""All attacks mixed for minutes: whether memory, descriptors and threads stay as they are."""

import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import httpx

from benchmarks.abuse.measuring import GIVE_UP_S, HISTORY_S, attacked, prepare, served
from benchmarks.common.tables import Table, heads
from benchmarks.service.soak import HELD, UNITS, Sample
from benchmarks.service.viewers import RANGE, Viewer, cut, watch

CONNECTIONS: Final = 8
SAMPLE_S: Final = 2.0
REST_S: Final = 20.0


@dataclass(frozen=True)
class Soak:
    """What a daemon held before, during and after the attacks."""

    frames: int
    expected: float
    before: list[Sample]
    during: list[Sample]
    after: list[Sample]


def soak(minutes: float) -> Soak:
    """Attack in every way, one after the other, and look at the daemon all the while."""
    before: list[Sample] = []
    during: list[Sample] = []
    after: list[Sample] = []
    with (
        served(tls=False) as process,
        httpx.Client(base_url=process.url, timeout=GIVE_UP_S) as client,
    ):
        rate_hz = prepare(process, client)
        time.sleep(HISTORY_S + 1.0)
        viewer = Viewer(process.stream_url, RANGE)

        def look(duration_s: float, samples: list[Sample]) -> float:
            def take() -> None:
                samples.append(Sample.of(process))

            return watch([viewer], duration_s=duration_s, every_s=SAMPLE_S, meanwhile=take)

        look(REST_S, before)
        count = len(viewer.seen.numbers)
        with attacked("mixed", process.url, CONNECTIONS):
            took_s = look(60.0 * minutes, during)
        frames = len(viewer.seen.numbers) - count
        time.sleep(1.0)
        look(REST_S, after)
        cut([viewer.connection])
    return Soak(frames, rate_hz * took_s, before, during, after)


def tables(*, minutes: float = 10.0) -> Iterator[Table]:
    """Mix all attacks for so many minutes."""
    result = soak(minutes)
    minute = max(1, round(60.0 / SAMPLE_S))
    columns = heads(" | before:.0f | first minute:.0f | last minute:.0f | most:.0f | after:.0f")
    table = Table("", columns)
    table.text.append(
        f"Frames of a viewer, of those due: {result.frames} of {result.expected:.0f}."
    )
    for place, (name, unit) in enumerate(zip(HELD, UNITS, strict=True), start=1):
        before, during, after = (
            [each[place] / unit for each in samples]
            for samples in (result.before, result.during, result.after)
        )
        means = (before, during[:minute], during[-minute:])
        most, left = max(during), statistics.mean(after[-3:])
        table.rows.append((name, *map(statistics.mean, means), most, left))
    yield table
