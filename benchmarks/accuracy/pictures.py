"""Draw what accuracy costs in time: ``python -m benchmarks.accuracy.pictures [SCENE ...]``.

With ``--write`` the pictures go to docs/figures; else to the folder of ``-o``.
"""

import argparse
from pathlib import Path
from typing import Any, Final

from benchmarks.accuracy.promises import BUILT_IN, ROOT, looked, measured
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff.picture import error_picture, saved
from transientcam_server.planning import Goal

FIGURES = ROOT / "docs" / "figures"
PRESENT: Final = Sequence(harmonics=4, zeroth="estimated")
"""The default sequence of the daemon, with Pisarenko's estimator."""


def drawn(scene: str, folder: Path) -> tuple[str, dict[str, Any]]:
    """Draw a scene's picture into a folder; return its name and the figures it shows."""
    name = Path(scene).stem
    planner, statistics = looked(scene)
    document = planner.tradeoff_document(Goal(), statistics)
    values, device_s, _ = measured(scene, PRESENT, "pisarenko", 10)
    figure = error_picture(document, name, (device_s, values["error"]))
    (folder / f"accuracy-{name}-error.png").write_bytes(saved(figure, "png"))
    return name, document


def main() -> None:
    """Draw the scenes named, or all that are built in."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="names or .toml; the built-in ones by default")
    parser.add_argument("-o", "--output", type=Path, default=Path())
    parser.add_argument("--write", action="store_true", help="write to docs/figures")
    arguments = parser.parse_args()
    folder = FIGURES if arguments.write else arguments.output
    folder.mkdir(parents=True, exist_ok=True)
    for scene in arguments.scenes or BUILT_IN:
        name, document = drawn(scene, folder)
        print(f"{name}: {document['summary']}", flush=True)


if __name__ == "__main__":
    main()
