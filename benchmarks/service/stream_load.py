"""Whether many viewers are served as promised.

Three things on one machine, all with the daemon a user would start, at the paper's video setting
(Sec. 6.3): what the stream carries beside a bare `websockets` server that sends the same bytes; how
long a frame takes from the last image's arrival to a client; and 200 viewers of range, 50 of them
stuck, for a minute.
"""

import contextlib
import socket
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import uvloop
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

import transientcam
from benchmarks.common.daemon import VIDEO, Process, daemon, running
from benchmarks.common.tables import Cell, Table, heads, met, percentiles
from benchmarks.service.viewers import RANGE, Viewer, cut, spending, stuck, watch
from transientcam import wire
from transientcam_driver import open_camera
from transientcam_server.api import build_app
from transientcam_server.daemon._server import Server, address, listen
from transientcam_server.imaging import Frame, History
from transientcam_server.settings import Settings

SIZES = ((163, 120), (640, 480))
SETTLE_S = 3.0
FLOOD_VIEWERS = (1, 16)
FLOOD_S = 2.0
FLOOD_ROUNDS = 3
GONE_WITHIN_S = 30.0
"""The promise on viewers that are stuck."""
ALL = wire.Subscribe((wire.Subscription("range"),), start=1).to_document()
"""The message that subscribes to range from the first frame on."""


# -- what the stream carries -------------------------------------------------------------------


class Endless(History):
    """An endless history of one frame: a client that resumes reads it as fast as it can."""

    @property
    def first(self) -> int | None:
        """The first."""
        return 1

    @property
    def last(self) -> int | None:
        """Never reached."""
        return 2**40

    def frame(self, number: int) -> Frame:
        """Return the one frame, whatever its number."""
        assert self.latest is not None
        return self.latest


def flood_from_stream() -> None:
    """Serve the daemon's own stream with an endless past."""
    with open_camera("sim:mirrors?noise=off") as camera:
        settings = Settings(port=0, log_level="warning")
        app = build_app(camera, settings)
        app.state.service.history = Endless(settings.history)
        with listen(settings.host, 0) as listener:
            url = address(listener)
            server = Server(app, settings, on_listening=lambda: print(url))
            server.run(sockets=[listener])


def flood_from_bare_server(message: Path) -> None:
    """Serve one message again and again with `websockets` alone, on the same kind of loop."""
    data = message.read_bytes()

    async def flood(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            await connection.recv()
            while True:
                await connection.send(data)

    async def main() -> None:
        protocols: Any = [wire.SUBPROTOCOL]
        async with serve(flood, "127.0.0.1", 0, compression=None, subprotocols=protocols) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            print(f"ws://127.0.0.1:{port}/")
            await server.serve_forever()

    uvloop.run(main())


@dataclass
class Flood:
    """Throughput of one server for one number of viewers, a value a round."""

    bytes_s: list[float] = field(default_factory=list)
    cpu_s_per_message: list[float] = field(default_factory=list)

    def take(self, url: str, process: Process, *, viewers: int) -> None:
        """Measure one round."""
        several = [Viewer(url, ALL, look=False) for _ in range(viewers)]
        watch(several, duration_s=0.5)
        elapsed_s, spent_s = spending(process, several, duration_s=FLOOD_S)
        cut(viewer.connection for viewer in several)
        messages = sum(viewer.seen.messages for viewer in several)
        self.bytes_s.append(sum(viewer.seen.received_bytes for viewer in several) / elapsed_s)
        self.cpu_s_per_message.append(spent_s / max(1, messages))


def measure_flood(directory: Path) -> dict[int, tuple[Flood, Flood]]:
    """Return what the daemon's stream and a bare server carry, by number of viewers."""
    itself = [sys.executable, "-m", "benchmarks.service.stream_load"]
    with running(itself) as ours:
        with transientcam.Camera(ours.url) as camera:
            camera.frame("range", wait_s=10.0)
            camera.stop()
        url = ours.stream_url
        message = directory / "message"
        message.write_bytes(_one_message(url))
        with running([*itself, str(message)]) as bare:
            found = {viewers: (Flood(), Flood()) for viewers in FLOOD_VIEWERS}
            for _ in range(FLOOD_ROUNDS):
                for viewers, (stream, plain) in found.items():
                    stream.take(url, ours, viewers=viewers)
                    plain.take(bare.url, bare, viewers=viewers)
    return found


def _one_message(url: str) -> bytes:
    from websockets.sync.client import connect

    protocols: Any = [wire.SUBPROTOCOL]
    with connect(url, subprotocols=protocols, compression=None, max_size=None) as connection:
        connection.send(wire.pack(ALL))
        connection.recv()  # hello
        data = connection.recv()
        assert isinstance(data, bytes)
        return data


# -- how long a frame takes --------------------------------------------------------------------


def measure_travel(width: int, height: int, *, duration_s: float) -> tuple[float, list[float]]:
    """Return the frames a second that one viewer of range sees, and how long each took, in ms."""
    with daemon("--camera", f"sim:mirrors?width={width}&height={height}") as process:
        viewer = _settled_viewer(process)
        elapsed_s, _ = spending(process, [viewer], duration_s=duration_s)
        viewer.connection.close()
    latencies_ms = [1e3 * latency_s for latency_s in viewer.seen.latencies_s]
    return len(latencies_ms) / elapsed_s, latencies_ms


def _settled_viewer(process: Process) -> Viewer:
    """Return a viewer of a camera that delivers video and has nothing left to compile."""
    with transientcam.Camera(process.url) as camera:
        camera.configure(**VIDEO)
        viewer = Viewer(process.stream_url, RANGE)
        while camera.info["kernels"]:
            watch([viewer], duration_s=SETTLE_S)
    return viewer


# -- many viewers ------------------------------------------------------------------------------


@dataclass
class Load:
    """What healthy viewers saw while others were stuck, and what the daemon spent."""

    viewers: int
    stuck: int
    duration_s: float
    rates_hz: list[float]
    latencies_s: list[float]
    dropped: int
    missing: int
    captured: int
    cpu_s: float
    resident_bytes: int
    gone_s: float | None

    @property
    def share(self) -> float:
        """Frames that half of the viewers got, over those captured meanwhile."""
        return statistics.median(self.rates_hz) * self.duration_s / self.captured


def measure_load(*, viewers: int, stuck_viewers: int, duration_s: float) -> tuple[Load, Load]:
    """Return what healthy viewers saw for a while alone, and then beside stuck ones."""
    with daemon() as process, transientcam.Camera(process.url) as camera:
        first = _settled_viewer(process)
        url = process.stream_url
        healthy = [first, *(Viewer(url, RANGE) for _ in range(viewers - stuck_viewers - 1))]
        watch(healthy, duration_s=SETTLE_S)
        alone = _observe(process, camera, healthy, [], duration_s=duration_s / 4.0)
        sockets = [stuck(url, RANGE) for _ in range(stuck_viewers)]
        beside = _observe(process, camera, healthy, sockets, duration_s=duration_s)
        cut([*(viewer.connection for viewer in healthy), *sockets])
    return alone, beside


def _observe(
    process: Process,
    camera: transientcam.Camera,
    healthy: list[Viewer],
    sockets: list[socket.socket],
    *,
    duration_s: float,
) -> Load:
    begin_s = time.perf_counter()
    gone_s: list[float] = []

    def look() -> None:
        if sockets and not gone_s and camera.info["clients"] <= len(healthy):
            gone_s.append(time.perf_counter() - begin_s)

    elapsed_s, cpu_s = spending(process, healthy, duration_s=duration_s, meanwhile=look)
    seen = [viewer.seen for viewer in healthy]
    first, last = min(each.numbers[0] for each in seen), max(each.numbers[-1] for each in seen)
    return Load(
        viewers=len(healthy) + len(sockets),
        stuck=len(sockets),
        duration_s=elapsed_s,
        rates_hz=[len(each.numbers) / elapsed_s for each in seen],
        latencies_s=[latency_s for each in seen for latency_s in each.latencies_s],
        dropped=sum(each.dropped for each in seen),
        missing=sum(each.missing for each in seen),
        captured=last - first + 1,
        cpu_s=cpu_s,
        resident_bytes=process.resident_bytes(),
        gone_s=gone_s[0] if gone_s else None,
    )


# -- tables ------------------------------------------------------------------------------------


def tables(*, seconds: float = 60.0, viewers: int = 200, stuck: int = 50) -> Iterator[Table]:
    """Measure many viewers for so many seconds, some stuck; one; and the stream beside a server."""
    yield _loads(measure_load(viewers=viewers, stuck_viewers=stuck, duration_s=seconds))
    yield _travels({size: measure_travel(*size, duration_s=8.0) for size in SIZES})
    with tempfile.TemporaryDirectory() as directory:
        yield _floods(measure_flood(Path(directory)))


def _loads(loads: tuple[Load, Load]) -> Table:
    alone, beside = loads
    change = beside.share / alone.share - 1.0
    gone = "not at all" if beside.gone_s is None else f"after {beside.gone_s:.1f} s"
    late = beside.gone_s is None or beside.gone_s > GONE_WITHIN_S
    lost = beside.dropped + beside.missing
    columns = heads(
        "viewers | of them stuck | for, s:.0f | frames/s, slowest / median | "
        "frames missing | drops reported | latency, 50 / 99 / 100 %, ms | "
        "daemon's share of one core:.0% | daemon's memory, MiB:.0f"
    )
    return Table(
        "Many viewers",
        columns,
        [_load(load) for load in loads],
        [
            f"- Drops of healthy viewers: {lost}; bar: 0, {met(lost == 0)}.",
            f"- Of the frames captured meanwhile half of them got {alone.share:.2%} without "
            f"stuck ones and {beside.share:.2%} beside them; bar: within 1 %, "
            f"{met(abs(change) <= 0.01)}.",
            f"- The stuck ones were gone {gone}; bar: {GONE_WITHIN_S:g} s, {met(not late)}.",
        ],
        [
            "Viewers of `range` at the paper's video setting (163 x 120, 18.6 frames/s), "
            "simulation included. Stuck ones subscribe and then never read."
        ],
    )


def _load(load: Load) -> Sequence[Cell]:
    return (
        load.viewers,
        load.stuck,
        load.duration_s,
        f"{min(load.rates_hz):.2f} / {statistics.median(load.rates_hz):.2f}",
        load.missing,
        load.dropped,
        percentiles([1e3 * each for each in load.latencies_s], (50, 99, 100)),
        load.cpu_s / load.duration_s,
        load.resident_bytes / 2**20,
    )


def _travels(travels: dict[tuple[int, int], tuple[float, list[float]]]) -> Table:
    rows = [
        (f"{width} x {height}", rate_hz, percentiles(latencies_ms, (50, 99)))
        for (width, height), (rate_hz, latencies_ms) in travels.items()
    ]
    small_ms = statistics.median(travels[SIZES[0]][1])
    return Table(
        "From the last image's arrival to the client",
        heads("pixels | frames/s:.1f | 50 / 99 %, ms"),
        rows,
        [
            f"- Half of the frames of {rows[0][0]} pixels took at most {small_ms:.1f} ms; bar: "
            f"15 ms, {met(small_ms < 15.0)}."
        ],
        ["One viewer of `range`, by one clock: what reconstruction, encoding and sending take."],
    )


def _floods(floods: dict[int, tuple[Flood, Flood]]) -> Table:
    rows: list[Sequence[Cell]] = []
    shares = []
    for viewers, (stream, bare) in floods.items():
        share = statistics.median(stream.bytes_s) / statistics.median(bare.bytes_s)
        shares.append(share)
        rows.append((viewers, *_flood(stream), *_flood(bare), share))
    numbers = ("MB/s:.0f", "processor time a message, µs:.0f")
    both = " | ".join(f"{of}: {what}" for of in ("the stream", "bare") for what in numbers)
    return Table(
        "Beside a bare server",
        heads(f"viewers | {both} | share:.0%"),
        rows,
        [
            f"- The stream carries at least {min(shares):.0%} of what the bare server does; bar: "
            f"70 %, {met(min(shares) >= 0.7)}."
        ],
        [
            "One message of `range` (163 x 120) as fast as viewers take it: from the daemon's "
            "stream, which hands out one frame as an endless past, and from a server of the "
            "`websockets` library that does nothing else; uvloop under both. Medians of "
            f"{FLOOD_ROUNDS} rounds of {FLOOD_S:g} s, taken in turn."
        ],
    )


def _flood(flood: Flood) -> tuple[float, float]:
    cpu_s = statistics.median(flood.cpu_s_per_message)
    return statistics.median(flood.bytes_s) / 1e6, 1e6 * cpu_s


if __name__ == "__main__":
    if len(sys.argv) > 1:
        flood_from_bare_server(Path(sys.argv[1]))
    else:
        flood_from_stream()
