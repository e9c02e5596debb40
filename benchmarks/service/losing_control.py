"""How long a camera's light stays on where the daemon loses control of it."""

from collections.abc import Iterator
from pathlib import Path

from benchmarks.common.tables import Table
from tests.server.daemon.losing_control import EVENTS, KINDS, SAFE_OFFS, Try, tries, try_all

LIMIT_S = 2.0


def tables(noted: Path, times: int = 100, cameras: int = 6) -> Iterator[Table]:
    """Lose control in every way, so many times of each kind of camera.

    ``noted``: keeps the tries; what it has is not tried again.
    """
    try_all(times, noted, cameras=cameras)
    found: dict[tuple[str, str], list[Try]] = {}
    for each in tries(noted):
        found.setdefault((each.event, each.kind), []).append(each)
    events = (*EVENTS, *SAFE_OFFS)
    rows = [[event, *(_cell(found.get((event, kind), [])) for kind in KINDS)] for event in events]
    yield Table("", ("what was tried", *KINDS), rows)


def _cell(found: list[Try]) -> str:
    good = sum(each.dark and each.took_s < LIMIT_S and not each.why for each in found)
    return f"{good} of {len(found)}, {max(each.took_s for each in found):.2f} s" if found else "-"
