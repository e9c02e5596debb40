"""The parts of ``docs/simulation.md`` that are not measured here: rules, and sizes by scene."""

from benchmarks.common.corner import RangeError
from benchmarks.simulation.scenes import BUILT_IN, scene_named, unseen
from transientcam_driver import Sequence
from transientcam_driver.cli.explain import scenes_table
from transientcam_driver.simulation.build import world_of
from transientcam_driver.simulation.effects import CALLED_ABOVE, EFFECTS, WORST_ABOVE

READOUT_S = 3.98e-3


def rule_lines(sequence: Sequence) -> list[str]:
    """Return the table of effects and their rules, and their sizes on each scene."""
    explanations = []
    for name in (*BUILT_IN, *unseen()):
        world = world_of(scene_named(name), width=163, height=120, readout_s=READOUT_S)
        explanations.append(world.explain(name, sequence))
    return [
        "## Which effects are built",
        "",
        f"An effect is built where it changes moments by more than {CALLED_ABOVE:g} of their",
        "noise, as a root mean square over the lit pixels, or by more than",
        f"{WORST_ABOVE:g} of its noise in any pixel judged. Effects of light are judged by leaving",
        "them out: moments with and without them, at the frequencies of the sequence, at several",
        "times of the scene's life if it moves.",
        "",
        "| effect | what it is | called for |",
        "|---|---|---|",
        *(
            f"| {effect.name} | {effect.what} "
            f"| {(effect.called_for.__doc__ or '').splitlines()[0].rstrip('.').lower()} |"
            for effect in EFFECTS
        ),
        "",
        "Sizes over the noise at video, as a root mean square and in the worst pixel; those of",
        "effects that are built are bold, the others are left out. `transientcam explain",
        "--all-scenes` makes the same table of the built-in scenes for any sequence.",
        "",
        *scenes_table(explanations).splitlines(),
        "",
    ]


def range_lines(errors: tuple[RangeError, ...]) -> list[str]:
    """Return the section of the page."""
    return [
        "## Range",
        "",
        "The range of the paper's Fig. 12 on `sim:corner` (f = 23 MHz, 4 takes), over all pixels:",
        "",
        "| estimate | RMS error | mean error | median absolute error | off by more than 0.1 m |",
        "|---|---|---|---|---|",
        *(
            f"| {each.name} | {each.rms_m * 1e3:.0f} mm | {each.bias_m * 1e3:.0f} mm "
            f"| {each.median_m * 1e3:.0f} mm | {each.outliers:.1%} |"
            for each in errors
        ),
        "",
    ]
