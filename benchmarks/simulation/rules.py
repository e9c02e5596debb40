"""Which effects are built in which scenes, by rules and sizes."""

from collections.abc import Iterator

from benchmarks.common.tables import Table
from benchmarks.simulation.costs import VIDEO
from benchmarks.simulation.scenes import BUILT_IN, READOUT_S, scene_named, unseen
from transientcam_simulation.cli.explain import scenes_table
from transientcam_simulation.effects import EFFECTS
from transientcam_simulation.emulated import world_of


def tables() -> Iterator[Table]:
    """State the rules, and the sizes of effects in each scene."""
    rows = [
        (effect.name, effect.what, _sentence(effect.called_for.__doc__ or "")) for effect in EFFECTS
    ]
    columns = ("effect", "what it is", "called for")
    yield Table("", columns, rows)
    explanations = []
    for name in (*BUILT_IN, *unseen()):
        world = world_of(scene_named(name), width=163, height=120, readout_s=READOUT_S)
        explanations.append(world.explain(name, VIDEO))
    lines = scenes_table(explanations).splitlines()
    head, _, *sizes = ([cell.strip() for cell in line.split("|")[1:-1]] for line in lines)
    text = "Sizes over the noise at video, as a root mean square and in the worst pixel:"
    yield Table("", head, sizes, text=[text])


def _sentence(said: str) -> str:
    return said.splitlines()[0].rstrip(".").lower()
