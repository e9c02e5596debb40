"""Run ``python -m benchmarks.accuracy [--quick] [-o FOLDER] [--write]``.

A run that is interrupted goes on where it stopped when it is given the same folder. ``--write``
keeps the page and its figures in docs/. The measured composite needs TRANSIENTCAM_TEST_DATA.
"""

import argparse
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

from rich.progress import Progress, TaskID

import transientcam_moments as tm
from benchmarks.accuracy.capturing import SEED, known_scenes
from benchmarks.accuracy.noise import draw_noise, predicted_and_observed
from benchmarks.accuracy.opening import draw_prices
from benchmarks.accuracy.page import report
from benchmarks.accuracy.pictures import drawn
from benchmarks.accuracy.promises import BUILT_IN
from benchmarks.accuracy.stated import stated_and_observed
from benchmarks.common.measured_scenes import composite_scene
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff.report import file_name

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SCENES = ("wall", "corner", "mirrors", "visitor")


def main() -> None:
    """Measure, print the page, and with ``--write`` keep it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few sequences instead of the paper's")
    parser.add_argument("-o", "--output", type=Path, help="folder of results; is resumed")
    parser.add_argument("--write", action="store_true", help="write docs/accuracy.md and figures")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.output or Path(temporary, "results")
        scenes = {name: name for name in SCENES if name in known_scenes()}
        folder.mkdir(parents=True, exist_ok=True)
        composite = composite_scene(folder)
        if composite is not None:
            scenes["composite"] = composite
        records = measured(scenes, folder, "quick" if arguments.quick else "paper")
        noise, stated = predicted_and_observed(), stated_and_observed()
        figures = DOCS / "figures" if arguments.write else folder
        figures.mkdir(exist_ok=True)
        drawings = dict(drawn(name, figures) for name in BUILT_IN)
        draw_prices(drawings, figures)
        page = report(scenes, records, noise, stated, drawings)
        print(page)
        if arguments.write:
            (DOCS / "accuracy.md").write_text(page, encoding="utf-8")
            draw_noise(noise, DOCS / "figures" / "noise-prediction.png")
            for spec in scenes.values():
                for name in ("repeatability", "cumulative"):
                    source = folder / f"{file_name(spec)}-{name}.png"
                    if source.exists():
                        target = DOCS / "figures" / f"accuracy-{file_name(spec)}-{name}.png"
                        target.write_bytes(source.read_bytes())


def _advance(progress: Progress, task: TaskID, kind: str) -> None:
    progress.advance(task)


def measured(scenes: dict[str, str], folder: Path, grid: str) -> tradeoff.Records:
    """Run the whole tradeoff and report it."""
    tm.kernels.compile()
    records, chosen = tradeoff.Records(folder), tradeoff.load_grid(grid)
    with Progress() as progress:
        for name, spec in scenes.items():
            # what computing and sending cost is hardly the scene's
            own = chosen if name == "mirrors" else replace(chosen, harmonics=())
            points = tradeoff.points_of(own, scene=spec, repetitions=5, seed=SEED)
            task = progress.add_task(name, total=len(points))
            tradeoff.measure(
                points,
                records,
                scene=spec,
                seed=SEED,
                progress=partial(_advance, progress, task),
            )
    tradeoff.report(folder, records)
    return records


if __name__ == "__main__":
    main()
