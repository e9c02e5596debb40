"""Draw what accuracy costs in time: ``python -m benchmarks.accuracy.pictures [SCENE ...]``.

With ``--write`` the pictures go to docs/figures, and docs/accuracy.md opens with them; else they go
to the folder of ``-o``.
"""

import argparse
from pathlib import Path
from typing import Final

from benchmarks.accuracy.opening import Drawn, draw_prices, opening, price, priced, replaced
from benchmarks.accuracy.promises import (
    BUILT_IN,
    ROOT,
    SETTINGS,
    dimmest_dn_per_s,
    looked,
    measured,
)
from benchmarks.common.machine import machine
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff.picture import error_picture, saved
from transientcam_server.planning import Goal

FIGURES = ROOT / "docs" / "figures"
PAGE = ROOT / "docs" / "accuracy.md"
PRESENT: Final = Sequence(harmonics=4, zeroth="estimated")
"""The default sequence of the daemon."""
CAPTURES: Final = 10


def drawn(scene: str, folder: Path) -> tuple[str, Drawn]:
    """Draw a scene's picture into a folder; return its name and the figures it shows."""
    name = Path(scene).stem
    planner, statistics = looked(scene)
    document = planner.tradeoff_document(Goal(), statistics)
    values, device_s, _ = measured(scene, PRESENT, SETTINGS.technique(noise_known=True), CAPTURES)
    figure = error_picture(document, name, (device_s, values["error"]))
    (folder / f"accuracy-{name}-error.png").write_bytes(saved(figure, "png"))
    front = document["front"]
    first = front[priced(front)]
    sequence, dimmest = Sequence.from_document(first["sequence"]), dimmest_dn_per_s(statistics)
    captured, _, _ = measured(scene, sequence, first["estimator"], CAPTURES, dimmest)
    return name, Drawn(front, document["summary"], captured["error"])


def main() -> None:
    """Draw the scenes named, or all that are built in; with ``--write`` also for the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="names or .toml; the built-in ones by default")
    parser.add_argument("-o", "--output", type=Path, default=Path())
    parser.add_argument("--write", action="store_true", help="write to docs/")
    arguments = parser.parse_args()
    folder = FIGURES if arguments.write else arguments.output
    folder.mkdir(parents=True, exist_ok=True)
    documents = {}
    for scene in arguments.scenes or BUILT_IN:
        name, found = drawn(scene, folder)
        documents[name] = found
        print(f"{name}: {price(found.front, found.measured_m)} {found.summary}", flush=True)
    draw_prices(documents, folder)
    if arguments.write:
        text = opening(documents, machine())
        PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), text), encoding="utf-8")


if __name__ == "__main__":
    main()
