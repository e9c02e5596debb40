"""The page of what attacks do: docs/abuse.md."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from benchmarks.abuse.attacks import HEALTHY, NICE, SOURCE
from benchmarks.abuse.measuring import COMES_BACK_S, GIVE_UP_S, Seen
from benchmarks.abuse.soaking import Soak
from benchmarks.common.machine import machine

PAGE: Final = Path(__file__).parents[2] / "docs" / "abuse.md"
_MIB = 2**20
FRAMES_BAR: Final = 0.9
LIVEZ_BAR_S: Final = 1.0
LIVEZ_CPU_BAR_S: Final = 0.1
LIGHT_BAR_S: Final = 1.0
GROWN_BAR_BYTES: Final = 64 * _MIB
END_BAR_S: Final = 5.0

Found = tuple[str, int, Seen]
_BEFORE: Final = "## Before"
_COLUMNS: Final = (
    "attack",
    "connections",
    "frames",
    "/livez",
    "its processor time",
    "lapse",
    "safe-off",
    "memory, most / left",
    "SIGTERM",
    "bars",
)


def met(seen: Seen) -> list[str]:
    """Return the bars that are missed."""
    limits = {
        "frames": seen.frames >= FRAMES_BAR,
        "/livez": seen.livez_s is not None and seen.livez_s <= LIVEZ_BAR_S,
        "processor": seen.livez_cpu_s is not None and seen.livez_cpu_s <= LIVEZ_CPU_BAR_S,
        "lapse": seen.lapse_s is not None and seen.lapse_s <= LIGHT_BAR_S,
        "safe-off": seen.safe_off_s is not None and seen.safe_off_s <= LIGHT_BAR_S,
        "memory": seen.grown_bytes <= GROWN_BAR_BYTES and seen.left_bytes <= GROWN_BAR_BYTES,
        "SIGTERM": seen.end_s is not None and seen.end_s <= END_BAR_S,
    }
    return [name for name, held in limits.items() if not held]


def row(name: str, connections: int, seen: Seen) -> str:
    """Return a line of the table."""
    missed = met(seen)
    bars = "missed: " + ", ".join(missed) if missed else "met"
    return "| " + " | ".join([name, str(connections), *_cells(seen), bars]) + " |"


def _cells(seen: Seen) -> list[str]:
    return [
        f"{seen.frames:.0%}",
        _seconds(seen.livez_s),
        _seconds(seen.livez_cpu_s),
        _seconds(seen.lapse_s),
        _seconds(seen.safe_off_s),
        f"{seen.grown_bytes / _MIB:.0f} / {seen.left_bytes / _MIB:.0f} MiB",
        _seconds(seen.end_s),
    ]


def _seconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.2f} s"


def page(found: Sequence[Found], *, duration_s: float, command: str) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# Attacks by clients",
            "",
            f"Written by `{command}` on {machine()}.",
            "",
            f"Each attack goes on at full speed for {duration_s:g} s and longer, from one process "
            f"at nice {NICE},",
            f"so that its own need of the processor does not starve the daemon, and from {SOURCE}: "
            "the daemon counts by",
            "address, and who shares an attacker's address shares its limits (one line shows "
            "that). No attack has a token;",
            f"the daemon asks for none, so that nothing else refuses them. Healthy clients come "
            f"from {HEALTHY}.",
            "",
            *_table(found),
            "",
            "- frames: of one viewer of range, over those without an attack; bar "
            f"{FRAMES_BAR:.0%}. With TLS, frames captured.",
            f"- /livez: the longest answer, each over a new connection; bar {LIVEZ_BAR_S:g} s.",
            "- its processor time: what the thread of the event loop spent meanwhile, at most; bar "
            f"{LIVEZ_CPU_BAR_S:g} s.",
            "- lapse, safe-off: from when the light should have gone off to the last capture; bar "
            f"{LIGHT_BAR_S:g} s.",
            f"- memory: growth at most, and {COMES_BACK_S:g} s after the attack; bar "
            f"{GROWN_BAR_BYTES // _MIB} MiB.",
            f"- SIGTERM: until the daemon has ended, under attack; bar {END_BAR_S:g} s.",
            f"- never: not within {GIVE_UP_S:g} s.",
            "",
        ]
    )


def page_with_before(
    text: str, found: Sequence[Found], *, command: str, commit: str, load: float
) -> str:
    """Return a page with a part, new or written anew, that says what was before.

    ``load`` is the system's load average before the first attack.
    """
    part = [
        _BEFORE,
        "",
        f"The daemon of commit {commit}, an older one, under the same attacks. "
        f"Written by `{command}` on {machine()}. "
        f"Other programs ran meanwhile: the load average before the first attack was {load:.1f}.",
        "",
        *_table(found),
        "",
    ]
    return text.partition(_BEFORE)[0].rstrip() + "\n\n" + "\n".join(part)


def _table(found: Sequence[Found]) -> list[str]:
    head = [f"| {' | '.join(_COLUMNS)} |", "|---|" + "---:|" * (len(_COLUMNS) - 2) + "---|"]
    return head + [row(*each) for each in found]


def page_with(text: str, found: Sequence[Found], *, command: str) -> str:
    """Return a page with some of its lines measured anew or added, which it then says."""
    text, begin, before = text.partition(_BEFORE)
    lines = text.rstrip().splitlines()
    for each in found:
        name, connections, *_ = each
        ours = f"| {name} | {connections} |"
        place = next(at for at, line in enumerate(lines) if line.startswith(f"| {name} |"))
        if any(line.startswith(ours) for line in lines):
            lines = [row(*each) if line.startswith(ours) else line for line in lines]
        else:
            lines.insert(place, row(*each))
    names = ", ".join(dict.fromkeys(name for name, *_ in found))
    again = f"- Measured again later, {names}: `{command}` on {machine()}."
    return "\n".join([*lines, again, "", begin + before])


def mixed_page(result: Soak) -> str:
    """Return the page of a long mix."""
    return "\n".join(
        [
            f"# {result.minutes:g} minutes of mixed attacks",
            "",
            f"Written by `python -m benchmarks.abuse --minutes {result.minutes:g} --write` on "
            f"{machine()}.",
            "",
            f"Frames of a viewer, of those due: {result.frames} of {result.expected:.0f}.",
            "",
            "| | before | first minute | last minute | most | after |",
            "|---|---:|---:|---:|---:|---:|",
            *(f"| {name} | {' | '.join(cells)} |" for name, cells in result.rows()),
            "",
        ]
    )
