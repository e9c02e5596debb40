"""Another scene, or other effects, in front of the same simulated camera while it runs."""

import threading
from typing import Any, cast

import numpy as np
import pytest

from tests.driver.conftest import OpenCamera
from transientcam_driver import Camera, CameraLost, EffectError, SceneError, Sequence, Simulation
from transientcam_driver.sequence import ImageLabel
from transientcam_simulation.imaging import SwitchableWorld, World


def _simulation(camera: Camera) -> Simulation:
    assert camera.simulation is not None
    return camera.simulation


def _frame_after_the_change(camera: Camera) -> Any:
    camera.read_frame()  # one may hold an image of both scenes
    return camera.read_frame().images


def test_frames_behind_a_change_are_those_of_a_camera_opened_before_that_scene(
    open_virtual: OpenCamera,
) -> None:
    changed, opened = open_virtual("sim:mirrors?noise=off"), open_virtual("sim:corner?noise=off")
    changed.start()
    before = changed.read_frame().images

    _simulation(changed).change(scene="corner")
    after = _frame_after_the_change(changed)
    opened.start()
    expected = _frame_after_the_change(opened)

    np.testing.assert_array_equal(after, expected)
    assert not np.array_equal(before, after)


def test_truth_name_and_explanation_follow_the_scene(open_virtual: OpenCamera) -> None:
    camera = open_virtual("sim:mirrors")
    simulation = _simulation(camera)

    simulation.change(scene="wall")

    expected = _simulation(open_virtual("sim:wall")).truth()
    np.testing.assert_array_equal(simulation.truth().range_m, expected.range_m)
    assert simulation.scene == simulation.explain().scene == "wall"


def test_the_camera_stays_the_same_unit_before_every_scene(open_virtual: OpenCamera) -> None:
    camera = open_virtual("sim:wall?device=prototype&noise=off")
    simulation = _simulation(camera)
    sensor, serial = simulation.sensor, camera.capabilities.serial

    simulation.change(scene="mirrors")

    assert simulation.sensor == sensor
    assert simulation.explain().device == "prototype"
    camera.start()
    assert camera.read_frame().lost_images == 0
    assert camera.capabilities.serial == serial


def test_chosen_effects_stay_from_scene_to_scene_until_others_are_chosen(
    open_virtual: OpenCamera,
) -> None:
    simulation = _simulation(open_virtual("sim:mirrors"))

    def ambient() -> str:
        effects = {each.effect: each for each in simulation.explain().effects}
        return effects["ambient"].choice

    assert ambient() == "auto"
    simulation.change(effects={"ambient": "on"})
    simulation.change(scene="wall")
    assert ambient() == "on"
    assert simulation.effects == {"ambient": "on"}
    simulation.change(effects={})
    assert ambient() == "auto"


def test_an_effect_forced_on_changes_the_images_at_once(open_virtual: OpenCamera) -> None:
    camera = open_virtual("sim:wall?noise=off")
    camera.start()
    without = _frame_after_the_change(camera)

    _simulation(camera).change(effects={"lens-scatter": "on"})

    assert not np.array_equal(_frame_after_the_change(camera), without)


def test_a_camera_unplugged_comes_back_before_the_scene_it_was_changed_to(
    open_virtual: OpenCamera,
) -> None:
    camera = open_virtual("sim:mirrors?noise=off")
    simulation = _simulation(camera)
    simulation.change(scene="wall")
    camera.start()
    simulation.unplug()
    with pytest.raises(CameraLost):
        camera.read_frame()
    simulation.replug()
    camera.reconnect()
    opened = open_virtual("sim:wall?noise=off")
    opened.start()

    np.testing.assert_array_equal(_frame_after_the_change(camera), _frame_after_the_change(opened))


@pytest.mark.parametrize(
    ("change", "field", "value"),
    [
        ({"effects": {"rain": "on"}}, "effects", "rain"),
        ({"effects": {"ambient": "maybe"}}, "effects.ambient", "maybe"),
    ],
)
def test_what_there_is_not_is_refused_by_name_and_nothing_changes(
    simulation: Simulation, change: dict[str, Any], field: str, value: str
) -> None:
    with pytest.raises(EffectError) as refused:
        simulation.change(**change)

    assert (refused.value.field, refused.value.value) == (field, value)
    assert simulation.effects == {}


def test_an_unknown_scene_is_refused_and_the_old_one_stays(simulation: Simulation) -> None:
    with pytest.raises(SceneError, match="moon"):
        simulation.change(scene="moon")

    assert simulation.scene == "mirrors"


class _SlowWorld:
    """Takes its time for the first sequence, and notes what it was prepared for."""

    def __init__(self) -> None:
        self.prepared_for: list[Sequence] = []
        self.preparing, self.go_on = threading.Event(), threading.Event()

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        self.sequence = sequence

    def prepare(self) -> None:
        self.prepared_for.append(self.sequence)
        self.preparing.set()
        assert self.go_on.wait(60.0)


def test_a_sequence_set_while_a_world_is_prepared_is_prepared_for_as_well() -> None:
    present, coming = _SlowWorld(), _SlowWorld()
    present.go_on.set()
    switchable = SwitchableWorld(cast(World, present))
    first, second = Sequence(harmonics=2), Sequence(harmonics=5)
    switchable.configure(first, ())
    changing = threading.Thread(target=switchable.change, args=(coming,))
    changing.start()
    assert coming.preparing.wait(60.0)

    switchable.configure(second, ())
    assert switchable.world is cast(World, present)
    coming.go_on.set()
    changing.join()

    assert switchable.world is cast(World, coming)
    assert coming.prepared_for == [first, second]


def test_the_diffuser_hides_the_scene_and_comes_off_again(open_virtual: OpenCamera) -> None:
    camera = open_virtual("sim:mirrors?noise=off")
    through = open_virtual("sim:calibration?noise=off")
    simulation = _simulation(camera)
    camera.start()
    through.start()
    before = _frame_after_the_change(camera)

    simulation.change(diffuser=True)
    behind = _frame_after_the_change(camera)
    assert (simulation.scene, simulation.diffuser) == ("mirrors", True)
    np.testing.assert_array_equal(behind, _frame_after_the_change(through))

    simulation.change(effects={})  # what is not named stays
    assert simulation.diffuser
    simulation.change(diffuser=False)
    np.testing.assert_array_equal(_frame_after_the_change(camera), before)
    assert not simulation.diffuser
