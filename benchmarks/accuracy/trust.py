"""Whether pixels say what they are worth: ranges, intervals and `trust` against the surface."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy import worlds
from benchmarks.accuracy.capturing import CAPTURE_SEED, SETTINGS
from benchmarks.common.tables import Table, heads
from transientcam.wire import Trust
from transientcam_driver import Camera, Sequence
from transientcam_driver.camera import Simulation
from transientcam_experiments.tradeoff import camera_before
from transientcam_experiments.tradeoff.capture import capture
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Intrinsics, Recipe
from transientcam_server.imaging._errors_of_range.accuracy import RangeAccuracy, range_accuracy
from transientcam_server.settings import SensorSettings
from transientcam_simulation.light._paths import first_hit
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.scene import load_scene

_Array = NDArray[Any]
_WRONG = 3.0
"""Times its `range_error`, beyond which a range is wrong."""
BUILT_IN: Final = ("wall", "corner-left")
AVERAGES: Final = ("gaussian", "edge-preserving")


class Judged(NamedTuple):
    """Pixels (P) of a scene that have a range, and no mirror in their centre."""

    error_m: _Array
    accuracy_m: _Array
    trust: _Array
    direct_share: _Array


def tables(
    *,
    scenes: int = 32,
    seed: int = 90817,
    directory: str = "",
    built_in: tuple[str, ...] = BUILT_IN,
) -> Iterator[Table]:
    """Judge scenes of a seed, a directory, and built-in ones, by each average over neighbours."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [*worlds.write(Path(folder), scenes, seed=seed)]
        paths += [str(each) for each in sorted(Path(directory).glob("*.toml")) if directory]
        names = [Path(path).stem for path in (*paths, *built_in)]
        found = [judged(path) for path in (*paths, *built_in)]
    for neighbours in AVERAGES:
        yield from _tables(neighbours, names, [each[neighbours] for each in found], len(paths))


def _tables(neighbours: str, names: list[str], found: list[Judged], others: int) -> Iterator[Table]:
    """Yield the tables of one average; the first ``others`` scenes are not built in."""
    table = Table(
        f"What pixels say of themselves, averaged {neighbours}",
        heads(
            "scene | no direct light:.1% | median error, mm:.1f | trusted:.1% | median interval, mm"
            ":.1f | in their interval:.1% | of the trusted:.1% | wrong:.1% | of these marked:.1%"
            " | of the right marked:.1% | of those lit directly:.1%"
        ),
        notes=[
            "A pixel is wrong where it is off the surface that it sees by more than "
            f"{_WRONG:g} times its `range_error`, right within its interval. Bars: 80 % of the "
            "wrong ones marked, 5 % of the right ones, 85 to 95 % in their interval, whose median "
            "is at most 3 times the median error. Mirrors are left out. Light from elsewhere "
            "leaves wide intervals, which hold though no surface was measured: the last column is "
            "of right pixels with more than half of their light from the lamp itself."
        ],
    )
    table.rows.extend((name, *_figures(of)) for name, of in zip(names, found, strict=True))
    if not others:
        yield table
        return
    # a built-in scene is one of a kind: in `corner-left` what shades the lamp leaves no trace
    together = Judged(*(np.concatenate(parts) for parts in zip(*found[:others], strict=True)))
    table.rows.append(("all but the built-in", *_figures(together)))
    yield table
    yield _of_reasons(together)


def judged(scene: str) -> dict[str, Judged]:
    """Capture a frame of a scene with the default sequence, and judge it by each average."""
    with camera_before(scene, seed=CAPTURE_SEED) as camera:
        simulation = camera.simulation
        assert simulation is not None
        recipe = _recipe(camera, simulation)
        (frame,) = capture(camera, 1, middle=True)
    found = {}
    for neighbours in AVERAGES:
        settings = SETTINGS.model_copy(update={"neighbours": neighbours})
        by = replace(recipe, settings=settings)
        image = by.reconstruct(frame.raw)
        accuracy: RangeAccuracy = range_accuracy(by, image, 1, frame.raw)
        error_m = np.abs(np.asarray(image.range_m) - frame.truth.range_m)
        kept = np.isfinite(error_m) & ~_mirrors(scene, error_m.shape)
        planes = error_m, accuracy.error_m, accuracy.trust, frame.truth.direct_share
        found[neighbours] = Judged(*(plane[kept] for plane in planes))
    return found


def _recipe(camera: Camera, simulation: Simulation) -> Recipe:
    applied, sensor = camera.configure(Sequence()), sensor_of(camera, SensorSettings())
    width, height = camera.capabilities.width, camera.capabilities.height
    seen = simulation.lens(width=width, height=height)
    lens = None
    if seen is not None:
        lens = Intrinsics.of_lens(seen, width=width, height=height, source="scene")
    highest = float(sensor.highest_dn)
    return Recipe(applied, SETTINGS, highest, sensor=sensor, intrinsics=lens)


def _mirrors(scene: str, shape: tuple[int, int]) -> _Array:
    """Return the pixels in whose centre is a mirror: what they show is elsewhere."""
    if not scene.endswith(".toml"):
        return np.zeros(shape, dtype=bool)
    loaded = load_scene(Path(scene))
    assert loaded.camera is not None
    rays = camera_rays(loaded.camera, width=shape[1], height=shape[0])
    start = np.broadcast_to(loaded.camera.position_m, rays.shape)
    which = first_hit(loaded, start, rays).surface
    kinds = np.array([each.kind == "mirror" for each in loaded.surfaces] + [False])
    return np.asarray(kinds[which].reshape(shape))


def _figures(of: Judged) -> tuple[float | None, ...]:
    trusted, held = of.trust == Trust.TRUSTED, of.error_m <= of.accuracy_m
    wrong = of.error_m > _WRONG * of.accuracy_m

    def share(of_them: _Array, among: _Array) -> float | None:
        return float(of_them[among].mean()) if among.any() else None

    return (
        float((of.direct_share == 0).mean()),
        1e3 * float(np.median(of.error_m)),
        float(trusted.mean()),
        1e3 * float(np.median(of.accuracy_m)),
        float(held.mean()),
        share(held, trusted),
        float(wrong.mean()),
        share(~trusted, wrong),
        share(~trusted, held),
        share(~trusted, held & (of.direct_share > 0.5)),
    )


def _of_reasons(of: Judged) -> Table:
    table = Table("", heads("reason | pixels:.2% | in their interval:.1% | wrong:.1%"))
    for reason in Trust:
        own = of.trust == reason
        if own.any():
            error_m, within_m = of.error_m[own], of.accuracy_m[own]
            held, wrong = error_m <= within_m, error_m > _WRONG * within_m
            table.rows.append((reason.name.lower(), own.mean(), held.mean(), wrong.mean()))
    return table
