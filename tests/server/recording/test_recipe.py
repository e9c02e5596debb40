"""Recorded frames are computed with what was recorded beside them."""

from dataclasses import asdict, replace
from typing import Any

import pytest

import transientcam_moments as tm
from tests.server.recording.made import CAPABILITIES, header
from transientcam_server.imaging import SettingsVersion
from transientcam_server.recording import recorded_recipe
from transientcam_server.recording._frames import recorded_sensor
from transientcam_server.settings import ReconstructionSettings

SENSOR = tm.noise.Sensor(gain_e_per_dn=8.0, full_well_e=33e3, read_noise_e=21.0, dark_dn=50.0)


def test_the_noise_is_that_of_the_recorded_sensor() -> None:
    recorded = header(camera={"sensor": asdict(SENSOR)})
    recipe = recorded_recipe(recorded, SettingsVersion(0, ReconstructionSettings()))
    assert recipe.sensor == SENSOR


def test_the_end_of_the_scale_is_the_highest_code_of_the_converter() -> None:
    recorded = header(capabilities=replace(CAPABILITIES, bits=10))

    recipe = recorded_recipe(recorded, SettingsVersion(0, ReconstructionSettings()))

    assert recipe.full_scale == 1023.0


@pytest.mark.parametrize(
    "changes", [None, 12, {}, {"gain_e_per_dn": 0.0}, {"bits": 12.5}, {"dark_dn": float("nan")}]
)
def test_a_file_without_a_sensor_or_with_an_impossible_one_has_none(changes: Any) -> None:
    sensor = asdict(SENSOR) | changes if changes and isinstance(changes, dict) else changes
    camera = {} if changes == {} else {"sensor": sensor}
    assert recorded_sensor(header(camera=camera)) is None
