"""Runs the matrix: ``python -m tests.surroundings [--write | --as-usual]``.

``--write`` puts the table into docs/platforms.md; ``--as-usual`` runs each verb once with what is
around this process, whichever user and home it has, and prints what is wrong as JSON.
"""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

from tests.surroundings.matrix import table
from tests.surroundings.verbs import SECRET, ran, standing_in, verbs

PAGE = Path(__file__).resolve().parents[2] / "docs" / "platforms.md"
BEGIN, END = "<!-- made by python -m tests.surroundings --write -->\n", "<!-- to here -->"
_OURS = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "STATE_DIRECTORY")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--as-usual", action="store_true")
    chosen = parser.parse_args()
    if chosen.as_usual:
        done = {each.name: ran([*each.words, *each.usual]) for each in verbs()}
        wrong = {name: problem for name, each in done.items() if (problem := each.problem())}
        sys.stdout.write(json.dumps(wrong) + "\n")
        return
    with tempfile.TemporaryDirectory() as folder, standing_in(Path(folder)):
        os.environ.update(dict.fromkeys(_OURS, folder))
        os.environ.update(TRANSIENTCAM_TOKEN=SECRET, TRANSIENTCAM_KERNELS="manual", COLUMNS="2000")
        made = table(verbs())
    sys.stdout.write(f"{made}\n")
    if chosen.write:
        text = PAGE.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        PAGE.write_text(
            f"{before}{BEGIN}\n{made}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8"
        )


if __name__ == "__main__":
    main()
