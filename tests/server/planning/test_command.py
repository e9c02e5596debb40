"""The command that plans."""

import json
from pathlib import Path
from typing import Any

import pytest
import typer

from transientcam_driver import Sequence
from transientcam_server.cli import plan as plan_verb

NEARBY: dict[str, Any] = {
    "camera": "sim:mirrors",
    "brightness_dn_per_s": 8e5,
    "returns": ["1.5", "3:0.5"],
    "fixed": ["harmonics=3", "zeroth=on-off", "base_frequency_hz=23e6"],
}


def test_the_command_prints_a_plan_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, range_error_m=0.01, as_json=True)

    said = json.loads(capsys.readouterr().out)
    assert said["sequence"]["harmonics"] == 3
    assert said["sequence"]["zeroth"] == "on-off"
    assert said["predicted"]["range_error_m"]["median"] <= 0.01
    assert said["predicted"]["range_bias_m"] <= said["predicted"]["range_error_m"]["median"]
    assert said["estimator"] in ("maximum-entropy", "likelihood")


def test_the_command_prints_a_plan_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, capture_s=0.1, separation_m=1.0, bound_width=9.0)

    first, *words = capsys.readouterr().out.splitlines()
    assert Sequence.from_document(json.loads(first)).harmonics == 3
    assert any(line.startswith("captures in") for line in words)
    assert any("bias" in line and "at 90 %" in line for line in words)
    assert any(line.startswith("a capture has 90% of the lit pixels within") for line in words)
    items = next(place for place, line in enumerate(words) if line.split()[:1] == ["light"])
    light_ms, readout_ms, settling_ms = map(float, words[items + 1].split()[:3])
    capture_ms = float(next(line for line in words if line.startswith("captures in")).split()[2])
    assert light_ms + readout_ms + settling_ms == pytest.approx(capture_ms, abs=0.2)
    assert any("twice the light gives" in line for line in words)
    assert any("both returns" in line for line in words)
    assert any("mean density" in line for line in words)
    assert any(line.startswith("half the time") for line in words)


@pytest.mark.parametrize("fixed", [[], ["base_frequency_hz=14e6"]])
def test_a_camera_without_sub_phases_is_planned_for_with_what_it_can_do(
    fixed: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Sub-phases of the default sequence are what an OPT8241 cannot do."""
    plan_verb.plan(
        camera="opt8241:emulated",
        brightness_dn_per_s=8e5,
        returns=["1.5"],
        fixed=fixed,
        range_error_m=0.05,
        as_json=True,
    )

    sequence = json.loads(capsys.readouterr().out)["sequence"]
    assert sequence["sub_phases"] == {"scheme": "none", "n": 1}
    assert not fixed or sequence["base_frequency_hz"] == pytest.approx(14e6, rel=1e-6)


def test_a_given_scene_has_no_region(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit):
        plan_verb.plan(**NEARBY, capture_s=0.1, region="0,0,9,9", as_json=True)

    assert json.loads(capsys.readouterr().out)["field"] == "region"


def test_the_command_fails_with_the_best_where_a_target_is_out_of_reach(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(typer.Exit) as ended:
        plan_verb.plan(**NEARBY, range_error_m=1e-9, as_json=True)

    assert ended.value.exit_code == 1
    assert json.loads(capsys.readouterr().out)["field"] == "range_error_m"


@pytest.mark.parametrize(
    "mistake",
    [
        {"fixed": ["harmonics"]},
        {"returns": ["near"]},
        {"returns": ["1:-2"]},
        {"estimator": "guess"},
        {"region": "1,2,3"},
        {"map_file": Path("map.tiff")},
    ],
)
def test_the_command_refuses_what_it_cannot_read(mistake: dict[str, Any]) -> None:
    with pytest.raises(typer.BadParameter):
        plan_verb.plan(**(NEARBY | mistake), capture_s=0.1)
