"""How long a camera's light stays on where the daemon loses control of it."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.common.tables import Table
from tests.server.daemon.losing_control import EVENTS, KINDS, SAFE_OFFS, Try, tries, try_all

LIMIT_S = 2.0


def tables(times: int = 100, cameras: int = 6, noted: Path | None = None) -> Iterator[Table]:
    """Lose control in every way, so many times of each kind of camera.

    ``noted``: a file of tries, of which only what is missing is done.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = noted or Path(folder) / "tries"
        try_all(times, file, cameras=cameras)
        found = tries(file)
    rows = [
        [
            event,
            *(
                _cell([each for each in found if (each.event, each.kind) == (event, kind)])
                for kind in KINDS
            ),
        ]
        for event in (*EVENTS, *SAFE_OFFS)
    ]
    note = "Several cameras at a time, each with a daemon and a supervisor of its own."
    yield Table("", ("what was tried", *KINDS), rows, [note])


def _cell(found: list[Try]) -> str:
    good = sum(each.dark and each.took_s < LIMIT_S and not each.why for each in found)
    return f"{good} of {len(found)}, {max(each.took_s for each in found):.2f} s" if found else "-"
