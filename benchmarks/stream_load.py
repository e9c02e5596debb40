"""Whether many viewers are served as promised: ``python -m benchmarks.stream_load [--write]``.

Three things on one machine, all with the daemon a user would start, at the paper's video setting
(Sec. 6.3: m = 3, 0.5 ms, 12 images, 18.6 Hz): what the stream carries beside a bare `websockets`
server that sends the same bytes; how long a frame takes from the last image's arrival to a client;
and 200 viewers of range, 50 of them stuck, for a minute.
"""

import argparse
import contextlib
import socket
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import uvloop
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

import transientcam
from benchmarks.daemon import Process, daemon, running
from benchmarks.machine import machine
from benchmarks.viewers import Viewer, cut, stuck, watch
from transientcam import wire
from transientcam_driver import open_camera
from transientcam_server.api import build_app
from transientcam_server.daemon._server import Server, address, listen
from transientcam_server.imaging import Frame, History
from transientcam_server.settings import Settings

PAGE = Path(__file__).parents[1] / "docs" / "stream-load.md"
VIDEO = {"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
SIZES = ((163, 120), (640, 480))
SETTLE_S = 3.0
FLOOD_VIEWERS = (1, 16)
FLOOD_S = 2.0
FLOOD_ROUNDS = 3
GONE_WITHIN_S = 30.0
"""The promise on viewers that are stuck."""


def subscribe(start: int | None = None) -> dict[str, Any]:
    """Return the message that subscribes to range."""
    return wire.Subscribe((wire.Subscription("range"),), start=start).to_document()


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
        several = [Viewer(url, subscribe(start=1), look=False) for _ in range(viewers)]
        watch(several, duration_s=0.5)
        before = [(v.seen.received_bytes, v.seen.messages) for v in several]
        cpu_s = process.cpu_s()
        elapsed_s = watch(several, duration_s=FLOOD_S)
        spent_s = process.cpu_s() - cpu_s
        now = [(v.seen.received_bytes, v.seen.messages) for v in several]
        cut(viewer.connection for viewer in several)
        received, messages = (
            sum(after[i] - earlier[i] for after, earlier in zip(now, before, strict=True))
            for i in (0, 1)
        )
        self.bytes_s.append(received / elapsed_s)
        self.cpu_s_per_message.append(spent_s / max(1, messages))


def measure_flood(directory: Path) -> dict[int, tuple[Flood, Flood]]:
    """Return what the daemon's stream and a bare server carry, by number of viewers."""
    itself = [sys.executable, "-m", "benchmarks.stream_load"]
    with running([*itself, "--flood", "stream"]) as ours:
        with transientcam.Camera(ours.url) as camera:
            camera.frame("range", wait_s=10.0)
            camera.stop()
        url = _stream(ours.url)
        message = directory / "message"
        message.write_bytes(_one_message(url))
        with running([*itself, "--flood", "bare", "--message", str(message)]) as bare:
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
        connection.send(wire.pack(subscribe(start=1)))
        connection.recv()  # hello
        data = connection.recv()
        assert isinstance(data, bytes)
        return data


# -- how long a frame takes --------------------------------------------------------------------


@dataclass(frozen=True)
class Travelled:
    """How long frames of one size took to one viewer."""

    width: int
    height: int
    rate_hz: float
    latencies_s: Sequence[float]


def measure_travel(width: int, height: int, *, duration_s: float) -> Travelled:
    """Return what one viewer of range sees."""
    with daemon("--camera", f"sim:mirrors?width={width}&height={height}") as process:
        viewer = _settled_viewer(process.url)
        begin = len(viewer.seen.numbers)
        elapsed_s = watch([viewer], duration_s=duration_s)
        viewer.connection.close()
    latencies_s = viewer.seen.latencies_s[begin:]
    return Travelled(width, height, len(latencies_s) / elapsed_s, latencies_s)


def _settled_viewer(url: str) -> Viewer:
    """Return a viewer of a camera that delivers video and has nothing left to compile."""
    with transientcam.Camera(url) as camera:
        camera.configure(**VIDEO)
        viewer = Viewer(_stream(url), subscribe())
        kernels: object = None
        # between two of them the compiler seems to be done
        while kernels != (kernels := camera.info["kernels"]) or camera.info["kernels"]["compiling"]:
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
        first = _settled_viewer(process.url)
        url = _stream(process.url)
        healthy = [first, *(Viewer(url, subscribe()) for _ in range(viewers - stuck_viewers - 1))]
        watch(healthy, duration_s=SETTLE_S)
        alone = _observe(process, camera, healthy, [], duration_s=duration_s / 4.0)
        sockets = [stuck(url, subscribe()) for _ in range(stuck_viewers)]
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
    before = [(len(viewer.seen.numbers), viewer.seen.dropped) for viewer in healthy]
    begin_s, cpu_s = time.perf_counter(), process.cpu_s()
    gone_s: list[float] = []

    def look() -> None:
        if sockets and not gone_s and camera.info["clients"] <= len(healthy):
            gone_s.append(time.perf_counter() - begin_s)

    elapsed_s = watch(healthy, duration_s=duration_s, meanwhile=look)
    numbers = [v.seen.numbers[b:] for v, (b, _) in zip(healthy, before, strict=True)]
    return Load(
        viewers=len(healthy) + len(sockets),
        stuck=len(sockets),
        duration_s=elapsed_s,
        rates_hz=[len(each) / elapsed_s for each in numbers],
        latencies_s=[
            each
            for v, (b, _) in zip(healthy, before, strict=True)
            for each in v.seen.latencies_s[b:]
        ],
        dropped=sum(v.seen.dropped - d for v, (_, d) in zip(healthy, before, strict=True)),
        missing=sum(each[-1] - each[0] + 1 - len(each) for each in numbers),
        captured=max(each[-1] for each in numbers) - min(each[0] for each in numbers) + 1,
        cpu_s=process.cpu_s() - cpu_s,
        resident_bytes=process.resident_bytes(),
        gone_s=gone_s[0] if gone_s else None,
    )


def _stream(url: str) -> str:
    return url.replace("http", "ws", 1).rstrip("/") + "/api/v1/stream"


# -- the page ----------------------------------------------------------------------------------


def report(
    floods: dict[int, tuple[Flood, Flood]], travels: list[Travelled], loads: Sequence[Load]
) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# What the stream carries",
            "",
            "Written by `python -m benchmarks.stream_load --write` on",
            f"{machine()}.",
            "",
            "Daemon and viewers share the machine; the viewers are one process that does little "
            "more than read.",
            "",
            *_loads(loads),
            *_travels(travels),
            *_floods(floods),
        ]
    )


def _loads(loads: Sequence[Load]) -> list[str]:
    alone, beside = loads
    change = beside.share / alone.share - 1.0
    gone = "not at all" if beside.gone_s is None else f"after {beside.gone_s:.1f} s"
    late = beside.gone_s is None or beside.gone_s > GONE_WITHIN_S
    return [
        "## Many viewers",
        "",
        "Viewers of `range` at the paper's video setting (163 x 120, 18.6 frames/s), simulation "
        "included.",
        "Stuck ones subscribe and then never read.",
        "",
        "| viewers | of them stuck | for | frames/s, slowest / median | frames missing "
        "| drops reported | latency, 50 / 99 / 100 % | daemon's share of one core "
        "| daemon's memory |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        *(_load(load) for load in loads),
        "",
        f"- Drops of healthy viewers: {beside.dropped + beside.missing}; bar: 0, "
        f"{_met(beside.dropped + beside.missing == 0)}.",
        f"- Of the frames captured meanwhile half of them got {alone.share:.2%} without stuck ones "
        f"and {beside.share:.2%} beside them; bar: within 1 %, {_met(abs(change) <= 0.01)}.",
        f"- The stuck ones were gone {gone}; bar: {GONE_WITHIN_S:g} s, {_met(not late)}.",
        "",
    ]


def _load(load: Load) -> str:
    return (
        f"| {load.viewers} | {load.stuck} | {load.duration_s:.0f} s "
        f"| {min(load.rates_hz):.2f} / {statistics.median(load.rates_hz):.2f} "
        f"| {load.missing} | {load.dropped} "
        f"| {_percentiles(load.latencies_s, (50, 99, 100))} ms "
        f"| {load.cpu_s / load.duration_s:.0%} | {load.resident_bytes / 2**20:.0f} MiB |"
    )


def _travels(travels: list[Travelled]) -> list[str]:
    small = 1e3 * statistics.median(travels[0].latencies_s)
    return [
        "## From the last image's arrival to the client",
        "",
        "One viewer of `range`, by one clock: what reconstruction, encoding and sending take.",
        "",
        "| pixels | frames/s | 50 / 99 % |",
        "|---|---:|---:|",
        *(
            f"| {each.width} x {each.height} | {each.rate_hz:.1f} "
            f"| {_percentiles(each.latencies_s, (50, 99))} ms |"
            for each in travels
        ),
        "",
        f"- Half of the frames of {travels[0].width} x {travels[0].height} pixels took at most "
        f"{small:.1f} ms; bar: 15 ms, {_met(small < 15.0)}.",
        "",
    ]


def _floods(floods: dict[int, tuple[Flood, Flood]]) -> list[str]:
    rows, shares = [], []
    for viewers, (stream, bare) in floods.items():
        share = statistics.median(stream.bytes_s) / statistics.median(bare.bytes_s)
        shares.append(share)
        rows.append(
            f"| {viewers} | {_flood(stream)} | {_flood(bare)} | {share:.0%} |",
        )
    return [
        "## Beside a bare server",
        "",
        "One message of `range` (163 x 120) as fast as viewers take it: from the daemon's stream, "
        "which hands out",
        "one frame as an endless past, and from a server of the `websockets` library that does "
        "nothing else;",
        f"uvloop under both. Medians of {FLOOD_ROUNDS} rounds of {FLOOD_S:g} s, taken in turn.",
        "",
        "| viewers | the stream: MB/s | processor time a message | bare: MB/s "
        "| processor time a message | share |",
        "|---:|---:|---:|---:|---:|---:|",
        *rows,
        "",
        f"- The stream carries at least {min(shares):.0%} of what the bare server does; bar: 70 %, "
        f"{_met(min(shares) >= 0.7)}.",
        "",
    ]


def _flood(flood: Flood) -> str:
    return (
        f"{statistics.median(flood.bytes_s) / 1e6:.0f} "
        f"| {1e6 * statistics.median(flood.cpu_s_per_message):.0f} µs"
    )


def _percentiles(values_s: Sequence[float], shares: Sequence[int]) -> str:
    ordered = sorted(values_s)
    picked = (ordered[min(len(ordered) - 1, len(ordered) * share // 100)] for share in shares)
    return " / ".join(f"{1e3 * value_s:.1f}" for value_s in picked)


def _met(met: bool) -> str:
    return "met" if met else "missed"


def main() -> None:
    """Measure, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long many viewers look")
    parser.add_argument("--viewers", type=int, default=200, help="how many there are")
    parser.add_argument("--stuck", type=int, default=50, help="how many of them never read")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    parser.add_argument("--flood", choices=("stream", "bare"), help=argparse.SUPPRESS)
    parser.add_argument("--message", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.flood == "stream":
        flood_from_stream()
        return
    if arguments.flood == "bare":
        flood_from_bare_server(arguments.message)
        return
    with tempfile.TemporaryDirectory() as directory:
        floods = measure_flood(Path(directory))
    travels = [measure_travel(*size, duration_s=8.0) for size in SIZES]
    loads = measure_load(
        viewers=arguments.viewers, stuck_viewers=arguments.stuck, duration_s=arguments.seconds
    )
    page = report(floods, travels, loads)
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
