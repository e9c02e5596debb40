import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from transientcam_simulation.cli.explain import explain


def run(*arguments: str) -> Result:
    app = typer.Typer()
    app.command()(explain)
    return CliRunner().invoke(app, arguments, env={"COLUMNS": "160"})


def test_the_text_says_what_is_called_for_why_and_how_large() -> None:
    result = run("mirrors")

    assert result.exit_code == 0, result.output
    built, left_out = result.output.split("Not there:")
    assert "mirror-paths: light over mirrors" in built
    assert "of the pixels see light over mirrors" in built
    assert "x the noise" in built
    assert "motion" in left_out
    assert max(map(len, result.output.splitlines())) <= 80


def test_all_scenes_make_a_table_of_sizes_over_the_noise() -> None:
    result = run("--all-scenes", "--exposure-s", "0.0005")

    assert result.exit_code == 0, result.output
    head, _rule, *rows = result.output.splitlines()
    columns = [cell.strip() for cell in head.split("|")]
    cells = {row.split("|")[1].strip(): row.split("|") for row in rows}
    assert {"wall", "corner", "mirrors", "visitor"} < set(cells)
    mirrors, shot = columns.index("mirror-paths"), columns.index("shot-noise")
    assert cells["mirrors"][mirrors].strip().startswith("**")
    assert not cells["wall"][mirrors].strip()
    assert all(row[shot].strip().startswith("**") for row in cells.values())


def test_json_holds_the_same_for_programs() -> None:
    document = json.loads(run("sim:corner?device=prototype", "--json", "--takes", "4").output)

    effects = {each["effect"]: each for each in document["effects"]}
    assert (document["scene"], document["device"]) == ("corner", "prototype")
    assert document["sequence"]["takes"] == 4
    assert effects["interreflection"]["built"]
    relative = effects["roll-off"]["size_dn"] / document["noise_floor_dn"]
    assert effects["roll-off"]["relative"] == pytest.approx(relative, rel=0.1)  # pixels differ
    assert effects["roll-off"]["worst"] > effects["roll-off"]["relative"]


def test_a_sequence_may_come_from_a_file_and_be_changed(tmp_path: Path) -> None:
    path = tmp_path / "sequence.json"
    path.write_text('{"harmonics": 2, "exposure_s": 0.0005}')

    result = run("wall", "--json", "--sequence", str(path), "--harmonics", "4")

    sequence = json.loads(result.output)["sequence"]
    assert (sequence["harmonics"], sequence["exposure_s"]) == (4, 0.0005)


def test_longer_sequences_call_for_more() -> None:
    """What the noise of one take hides stands out of the average of many."""

    def relative(takes: str) -> float:
        document = json.loads(run("sim:corner?device=prototype", "--json", "--takes", takes).output)
        effects = {each["effect"]: each for each in document["effects"]}
        return float(effects["modulation-harmonics"]["relative"])

    assert relative("16") == pytest.approx(4 * relative("1"))


def test_a_choice_in_the_name_is_obeyed() -> None:
    document = json.loads(run("sim:mirrors?mirror-paths=off&ambient=on", "--json").output)

    effects = {each["effect"]: each for each in document["effects"]}
    assert effects["mirror-paths"]["called_for"]
    assert not effects["mirror-paths"]["built"]
    assert effects["ambient"]["built"]
    assert effects["ambient"]["choice"] == "on"
    assert effects["quantisation"]["choice"] == "always"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "one of calibration"),
        ([], "name a scene, or give --all-scenes"),
        (["wall", "--all-scenes"], "name a scene, or give --all-scenes"),
        (["usb"], "a real camera has no scene"),
        (["wall", "--harmonics", "99"], "harmonics = 99"),
        (["wall", "--base-frequency-hz", "1e9"], "base_frequency_hz"),
        (["wall", "--sequence", "absent.json"], "absent.json"),
        (["sim:wall?fog=on"], "fog"),
        (["sim:wall?ambient=maybe"], "auto, on, off"),
    ],
)
def test_bad_input_is_reported_in_one_line(arguments: list[str], message: str) -> None:
    result = run(*arguments)

    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_light_that_cannot_be_made_and_a_lens_that_scatters_are_named(tmp_path: Path) -> None:
    """A varnished floor before a wall shows the wall, but not where light goes no further."""
    path = tmp_path / "varnish.toml"
    path.write_text("""
        [camera]
        look_at_m = [0.0, 2.0, -0.3]
        [light]
        position_m = [0.05, 0.0, 0.1]
        aim_at_m = [0.0, 2.0, 0.0]
        electrons_per_s = 6e7
        [device]
        lens_scatter = { share = 0.02 }
        [transport]
        diffuse_bounces = 0
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 2.2, 0.0]
        normal = [0.0, -1.0, 0.0]
        size_m = [4.0, 3.0]
        albedo = 0.7
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 1.6, -0.7]
        normal = [0.0, 0.0, 1.0]
        size_m = [4.0, 1.2]
        albedo = 0.3
        gloss = 0.2
        gloss_exponent = 200
    """)

    text = run(str(path)).output
    called, lacks = text.split("Called for, and cannot be made:")
    assert "further-bounces" in lacks
    assert "further-bounces" not in called
    assert "ideal (but for lens scatter) device" in " ".join(text.split())
    assert lacks.count("shot-noise") == 1
    assert "shot-noise" not in called
