"""What healthy clients have under each attack, and whether that reaches the bars."""

from collections.abc import Iterator
from typing import Final

from benchmarks.abuse.attacks import ATTACKS
from benchmarks.abuse.measuring import COMES_BACK_S, GIVE_UP_S, AttackOutcome, measure
from benchmarks.common.tables import Cell, Table, heads

_MIB = 2**20
FRAMES_BAR: Final = 0.9
LIVEZ_BAR_S: Final = 1.0
LIVEZ_CPU_BAR_S: Final = 0.1
LIGHT_BAR_S: Final = 1.0
BESIDE_BAR_S: Final = 0.2
GROWN_BAR_BYTES: Final = 64 * _MIB
END_BAR_S: Final = 5.0

_COLUMNS: Final = heads(
    "attack | connections | frames:.0% | /livez | its processor time | lapse | "
    "safe-off | safe-off beside it | memory, most / left, MiB | SIGTERM | bars"
)


def missed(seen: AttackOutcome) -> list[str]:
    """Return the bars that are missed."""
    limits = {
        "frames": seen.frames >= FRAMES_BAR,
        "/livez": seen.livez_s is not None and seen.livez_s <= LIVEZ_BAR_S,
        "processor": seen.livez_cpu_s is not None and seen.livez_cpu_s <= LIVEZ_CPU_BAR_S,
        "lapse": seen.lapse_s is not None and seen.lapse_s <= LIGHT_BAR_S,
        "safe-off": seen.safe_off_s is not None and seen.safe_off_s <= LIGHT_BAR_S,
        "beside": seen.beside_s is not None and seen.beside_s <= BESIDE_BAR_S,
        "memory": seen.grown_bytes <= GROWN_BAR_BYTES and seen.left_bytes <= GROWN_BAR_BYTES,
        "SIGTERM": seen.end_s is not None and seen.end_s <= END_BAR_S,
    }
    return [name for name, held in limits.items() if not held]


def tables(
    *,
    attacks: tuple[str, ...] = tuple(ATTACKS),
    connections: tuple[int, ...] = (1, 16),
    seconds: float = 5.0,
) -> Iterator[Table]:
    """Attack a daemon of its own at full speed from so many connections, half a minute each.

    The simulated camera is at the paper's video setting. Meanwhile a viewer streams range, /livez
    is asked, a lease lapses, the light is switched off, and SIGTERM ends it.
    """
    if unknown := set(attacks) - set(ATTACKS):
        raise SystemExit(f"unknown attacks {unknown}, choose from {', '.join(ATTACKS)}")
    yield Table(
        "",
        _COLUMNS,
        [
            _row(name, count, measure(name, count, duration_s=seconds))
            for name in attacks
            for count in connections
        ],
        [
            "- frames: of one viewer of range, over those without an attack; bar "
            f"{FRAMES_BAR:.0%}. With TLS, frames captured.",
            f"- /livez: the longest answer, each over a new connection; bar {LIVEZ_BAR_S:g} s.",
            "- its processor time: what the thread of the event loop spent meanwhile, at most; "
            f"bar {LIVEZ_CPU_BAR_S:g} s.",
            "- lapse, safe-off: from when the light should have gone off to the last capture; bar "
            f"{LIGHT_BAR_S:g} s.",
            "- safe-off beside it: from the attack's address, over a new connection, until it is "
            f"answered with 200; the longest of some; bar {BESIDE_BAR_S:g} s.",
            f"- memory: growth at most, and {COMES_BACK_S:g} s after the attack; bar "
            f"{GROWN_BAR_BYTES // _MIB} MiB.",
            f"- SIGTERM: until the daemon has ended, under attack; bar {END_BAR_S:g} s.",
            f"- never: not within {GIVE_UP_S:g} s.",
        ],
        [f"Each attack goes on for {seconds:g} s and longer."],
    )


def _row(name: str, connections: int, seen: AttackOutcome) -> tuple[Cell, ...]:
    below = missed(seen)
    row: tuple[Cell, ...] = (
        name,
        connections,
        seen.frames,
        *map(
            _seconds, (seen.livez_s, seen.livez_cpu_s, seen.lapse_s, seen.safe_off_s, seen.beside_s)
        ),
        f"{seen.grown_bytes / _MIB:.0f} / {seen.left_bytes / _MIB:.0f}",
        _seconds(seen.end_s),
        "missed: " + ", ".join(below) if below else "met",
    )
    print(*row, flush=True)
    return row


def _seconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.2f} s"
