"""`transientcam calibrate --lens`, before a simulated wall, through the command line."""

import tomllib
from collections.abc import Iterator

import pytest

from tests.server.imaging.calibrations.test_board import LENS, SIDES, chessboard, picture
from tests.serving import Served, serving
from transientcam import Camera
from transientcam.cli import run
from transientcam_server.settings import LensSettings

WALL = """name = "flat"
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [{aside}, 2.0, {up}]
field_of_view_deg = 60.0
lens = {{k1 = -0.15}}
[light]
position_m = [0.0, 0.0, 0.0]
aim_at_m = [{aside}, 2.0, {up}]
electrons_per_s = 5.0e7
[[surface]]
name = "wall"
kind = "diffuse"
centre_m = [0.0, 1.5, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [40.0, 40.0]
albedo = 0.8
"""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:wall?noise=off") as daemon:
        daemon.start_all_workers()
        yield daemon


def test_walls_that_are_shown_one_after_the_other_give_settings_of_the_lens(
    served: Served, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    shown = [(0.8, 0.2), (-0.4, 0.8)]
    with Camera(served.url) as camera:
        camera.sequence = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}
        camera.simulate(definition=WALL.format(aside=0.0, up=0.0))
        monkeypatch.setattr(
            "typer.prompt",
            lambda text, **_: camera.simulate(
                definition=WALL.format(aside=shown[-1][0], up=shown.pop()[1])
            ),
        )
        arguments = ["calibrate", served.url, "--lens", "--views", "2", "--takes", "2"]
        assert run(arguments) == 0
        scene = camera.camera["intrinsics"]

    found = LensSettings(**tomllib.loads(capfd.readouterr().out)["lens"])
    assert found.fx_px == pytest.approx(scene["fx"], rel=0.01)
    assert found.cx_px == pytest.approx(scene["cx"], abs=1.0)
    assert found.distortion[0] == pytest.approx(-0.15, abs=0.02)


def test_a_board_that_is_shown_from_several_sides_gives_settings_of_the_lens(
    served: Served, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    pictures = [picture(chessboard, *side) for side in SIDES]
    pictures.insert(1, 0 * pictures[0])
    views = str(len(pictures))
    monkeypatch.setattr("typer.prompt", lambda text, **_: None)
    monkeypatch.setattr("transientcam_server.cli.calibrate._mean", lambda *_: pictures.pop())

    assert run(["calibrate", served.url, "--lens", "--board", "9x6", "--views", views]) == 0

    out, err = capfd.readouterr()
    assert "no 9x6 was found" in err
    assert f"# pictures = {len(SIDES)}" in out
    found = LensSettings(**tomllib.loads(out)["lens"])
    assert found.fx_px == pytest.approx(LENS.fx, abs=1.5)
    assert found.distortion[0] == pytest.approx(LENS.distortion[0], abs=0.02)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--board", "9x6"], "--board"),
        (["--lens", "--board", "9x6", "--second", "http://127.0.0.1:9"], "--second"),
        (["--lens", "-o", "lens.npz"], "--output"),
        (["--lens", "--undo"], "--undo"),
    ],
)
def test_what_cannot_be_measured_is_refused_at_once(
    served: Served, arguments: list[str], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["calibrate", served.url, *arguments]) == 2

    assert message in capfd.readouterr().err.replace("\n", " ")


def test_a_white_wall_gives_the_beam_that_the_scene_has(
    served: Served, capfd: pytest.CaptureFixture[str]
) -> None:
    with Camera(served.url) as camera:
        camera.sequence = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}
        narrow = WALL.format(aside=0.3, up=0.1).replace("= 5.0e7", "= 5.0e7\nbeam_exponent = 8.0")
        camera.simulate(definition=narrow.replace("albedo = 0.8", "albedo = 1.0"))
        *axis, exponent, white_dn_per_s = camera.camera["intrinsics"]["beam"]

    assert run(["calibrate", served.url, "--beam", "--takes", "2"]) == 0

    found = LensSettings(**tomllib.loads(capfd.readouterr().out)["lens"]).beam
    assert found[:3] == pytest.approx(axis, abs=0.02)
    assert found[3:] == pytest.approx((exponent, white_dn_per_s), rel=0.05)
