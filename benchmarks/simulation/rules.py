"""Which effects are built in which scenes, by rules and sizes; and the range of a corner."""

from collections.abc import Iterator

from benchmarks.common.corner import range_errors
from benchmarks.common.tables import Column, Table
from benchmarks.simulation.costs import READOUT_S, VIDEO
from benchmarks.simulation.scenes import BUILT_IN, scene_named, unseen
from transientcam_driver.cli.explain import scenes_table
from transientcam_driver.simulation.build import world_of
from transientcam_driver.simulation.effects import CALLED_ABOVE, EFFECTS, WORST_ABOVE


def tables() -> Iterator[Table]:
    """State the rules, and the sizes of effects in each scene."""
    rows = [
        (effect.name, effect.what, _sentence(effect.called_for.__doc__ or "")) for effect in EFFECTS
    ]
    text = (
        f"An effect is built where it changes moments by more than {CALLED_ABOVE:g} of their "
        f"noise, as a root mean square over the lit pixels, or by more than {WORST_ABOVE:g} of its "
        "noise in any pixel judged. Effects of light are judged by leaving them out: moments with "
        "and without them, at the frequencies of the sequence, at several times of the scene's "
        "life if it moves."
    )
    columns = ("effect", "what it is", "called for")
    yield Table("Which effects are built", columns, rows, text=[text])
    explanations = []
    for name in (*BUILT_IN, *unseen()):
        world = world_of(scene_named(name), width=163, height=120, readout_s=READOUT_S)
        explanations.append(world.explain(name, VIDEO))
    lines = scenes_table(explanations).splitlines()
    head, _, *sizes = ([cell.strip() for cell in line.split("|")[1:-1]] for line in lines)
    text = (
        "Sizes over the noise at video, as a root mean square and in the worst pixel; those of "
        "effects that are built are bold, the others are left out. `transientcam explain "
        "--all-scenes` makes the same table of the built-in scenes for any sequence."
    )
    yield Table("", head, sizes, text=[text])


def _sentence(said: str) -> str:
    return said.splitlines()[0].rstrip(".").lower()


def ranges() -> Iterator[Table]:
    """Hold the range of the paper's Fig. 12 against the truth."""
    columns = ("RMS error, mm", "mean error, mm", "median absolute error, mm")
    yield Table(
        "Range",
        (
            "estimate",
            *(Column(each, ".0f") for each in columns),
            Column("off by more than 0.1 m", ".1%"),
        ),
        [
            (each.name, 1e3 * each.rms_m, 1e3 * each.bias_m, 1e3 * each.median_m, each.outliers)
            for each in range_errors()
        ],
        text=[
            "The range of the paper's Fig. 12 on `sim:corner` (f = 23 MHz, 4 takes), over all "
            "pixels:"
        ],
    )
