"""Estimators and products of other packages: offered everywhere, and no harm to others."""

import json
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from shutil import copy
from typing import Any

import httpx
import numpy as np
import pytest
import rerun as rr
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import transientcam
import transientcam_moments as tm
from tests.client.robotics.viewer import viewing
from tests.conftest import ROOT
from tests.server.camera.plug_in import install as install_wall, install_package
from tests.server.recording.made import record
from tests.serving import serving
from transientcam import Camera
from transientcam.cli import run as command
from transientcam.errors import ParameterError, ProblemError
from transientcam.robotics import FoxgloveBridge, RerunBridge
from transientcam_moments import comparisons, plugins
from transientcam_server.api import _parameters as parameters
from transientcam_server.daemon import _doctor as doctor
from transientcam_server.imaging import OtherPackages

EXAMPLE = ROOT / "examples" / "matched_filter"
MAP_EXAMPLE = ROOT / "examples" / "range_disagreement"
PAGE = ROOT / "docs" / "add-an-estimator.md"
FAULTY = """
import os, threading
from dataclasses import replace
from pathlib import Path
from matched_filter import ESTIMATOR, matched_filter
from range_disagreement import PRODUCT

BEGUN = Path(__file__).with_name("begun")

def raises(b, **_):
    raise ZeroDivisionError("by hand")

def hangs_once(b, **_):
    if not BEGUN.exists():
        BEGUN.touch()
        threading.Event().wait()
    return matched_filter(b)

def ends(b, **_):
    os._exit(3)

RAISES, HANGS, ENDS = (
    replace(ESTIMATOR, name=each.__name__.replace("_", "-"), estimate=each)
    for each in (raises, hangs_once, ends)
)
SMALL = replace(PRODUCT, name="small", compute=lambda b, **_: b[1, :2].real)
"""
FAULTY_POINTS = """
[transientcam.estimators]
raises = faulty:RAISES
hangs-once = faulty:HANGS
ends = faulty:ENDS
absent = package_that_is_not_there:ESTIMATOR
[transientcam.products]
range-disagreement = range_disagreement:PRODUCT
small = faulty:SMALL
missing = package_that_is_not_there:PRODUCT
range = faulty:SMALL
"""
PHASE_RAD = np.array([0.4, 2.0])
MOMENTS = np.exp(1j * np.arange(5)[:, None] * PHASE_RAD)
GIVEN = (MOMENTS, None, 20e6 * np.arange(5), 0.1)
CALL = comparisons.PLUGINS.group, comparisons.separated


def forget() -> None:
    for offered in plugins.GROUPS.values():
        offered.points.cache_clear()
        offered.loaded.cache_clear()
    parameters._properties.cache_clear()


@pytest.fixture(scope="module", autouse=True)
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Two packages of others."""
    directory = tmp_path_factory.mktemp("estimators")
    modules = {"matched_filter.py": (EXAMPLE / "matched_filter.py").read_text("utf-8")}
    described = (EXAMPLE / "pyproject.toml").read_text("utf-8")
    found = install_package(directory, described, modules)
    (found / "faulty.py").write_text(FAULTY)
    copy(MAP_EXAMPLE / "range_disagreement.py", found)
    about = found / "faulty-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(FAULTY_POINTS)
    with pytest.MonkeyPatch.context() as patch:
        for each in (found, install_wall(tmp_path_factory.mktemp("wall"))):
            patch.syspath_prepend(str(each))
        forget()
        yield found
        for name in ("matched_filter", "faulty", "range_disagreement"):
            sys.modules.pop(name, None)
    forget()


@dataclass
class ClockOfHanging:
    """Seconds: 0 until the estimator hangs, very late from then on."""

    begun: Path
    more_s: float = field(default=0.0)

    def __call__(self) -> float:
        return self.more_s + (1e6 if self.begun.exists() else 0.0)


@pytest.fixture
def others(site: Path) -> Iterator[OtherPackages]:
    clock = ClockOfHanging(site / "begun")
    found = OtherPackages(10.0, clock=clock)
    found.open()
    yield found
    found.close()
    assert [plugins.call_here] == plugins.CALLERS


def test_one_that_hangs_is_ended_left_alone_for_a_while_and_asked_again(
    others: OtherPackages,
) -> None:
    with pytest.raises(tm.PluginFailed, match=r"hangs-once .*longer than 10 s"):
        others(*CALL, "hangs-once", *GIVEN)
    with pytest.raises(tm.PluginFailed, match="longer than 10 s; it is asked again in"):
        others(*CALL, "hangs-once", *GIVEN)

    clock = others._clock
    assert isinstance(clock, ClockOfHanging)
    clock.more_s = 1e8

    assert others(*CALL, "hangs-once", *GIVEN).phase_rad == pytest.approx(PHASE_RAD)


def test_one_that_ends_its_process_costs_its_own_range_alone(others: OtherPackages) -> None:
    with pytest.raises(tm.PluginFailed, match=r"ends .*its process has ended"):
        others(*CALL, "ends", *GIVEN)
    with pytest.raises(tm.PluginFailed, match=r"raises .*ZeroDivisionError: by hand"):
        others(*CALL, "raises", *GIVEN)


def test_a_daemon_offers_them_and_its_other_products_go_on() -> None:
    limits = {"estimator_s": 600.0}
    with (
        serving("sim:wall?noise=off", limits=limits) as served,
        httpx.Client(base_url=f"{served.url}/api/v1", timeout=60) as http,
        Camera(served.url, timeout_s=600.0) as camera,
    ):
        described = http.get("/parameters").json()["parameters"]
        info = {each["name"]: each for each in http.get("/info").json()["estimators"]}
        camera.reconstruction = {"estimator": "matched-filter"}
        with camera.stream("range") as frames:
            frame = next(each for each in frames if each.meta["estimator"] == "matched-filter")
        truth_m = camera.frame("truth").array

        camera.reconstruction = {"estimator": "raises"}
        with camera.stream("brightness") as frames:
            first = next(each for each in frames if each.meta["estimator"] == "raises")
            with pytest.raises(
                ProblemError, match=r"raises of another .*ZeroDivisionError: by hand"
            ):
                camera.frame("range")
            later = next(iter(frames))
        pixel = http.get("/frames/latest/pixel", params={"x": 80, "y": 60}).json()
        refused = http.put("/reconstruction", json={"estimator": "absent"})
        unknown = http.put("/reconstruction", json={"estimator": "nonsense"})

    (allowed,) = (e["allowed"] for e in described if e["name"] == "reconstruction.estimator")
    assert {"matched-filter", "raises", "ends", "hangs-once", "likelihood"} <= set(allowed)
    assert "absent" not in allowed
    assert info["matched-filter"]["failure"] == "Other light pulls the range to it."
    assert "not_there" in info["absent"]["unusable"]
    assert np.nanmedian(np.abs(frame.array - truth_m)) < 1e-3
    assert later.meta["frame"] > first.meta["frame"]
    assert pixel["range_m"] is None
    assert max(pixel["cumulative"]) > 0
    assert refused.status_code == 409
    assert "'matched-filter' of another package" in unknown.text
    assert "package_that_is_not_there" in refused.json()["detail"]


def live_in_viewers(camera: Camera, product: str, file: Path) -> tuple[Any, bytes]:
    """Show a product in Foxglove, and as a file of Rerun."""
    with FoxgloveBridge(camera, products=[product], port=0) as bridge:
        thread = threading.Thread(target=bridge.run)
        thread.start()
        with viewing(bridge.url) as viewer:
            viewer.subscribe(f"/{product}")
            seen = viewer.message(f"/{product}").decoded
        bridge.close()
        thread.join()
    recording = rr.RecordingStream("transientcam")
    recording.set_sinks(rr.FileSink(file))
    with RerunBridge(camera, recording, products=[product]) as rerun:
        rerun.run(1)
    recording.disconnect()
    return seen, file.read_bytes()


def test_a_daemon_has_their_products_beside_its_own(tmp_path: Path) -> None:
    (wall := tmp_path / "wall.txt").write_text("2.5")
    with (
        # 16, 80 and 120 MHz
        serving(f"wall:{wall}?frequencies=fixed", limits={"estimator_s": 600.0}) as served,
        Camera(served.url, timeout_s=600.0) as camera,
    ):
        info = camera.info
        with camera.stream("range-disagreement", "range") as frames:
            streamed = next(iter(frames))
        with pytest.raises(ProblemError, match=r"small of another .*shape \(2, "):
            camera.frame("small")
        apart, moments = camera.frame("range-disagreement"), camera.frame("moments")
        picture = httpx.get(f"{served.url}/api/v1/frames/latest/range-disagreement.png")
        asyncapi = httpx.get(f"{served.url}/asyncapi.json").text
        viewed, logged = live_in_viewers(camera, "range-disagreement", tmp_path / "a.rrd")
        with pytest.raises(ParameterError, match="direct_share, range-disagreement"):
            FoxgloveBridge(camera, products=["nothing"], port=0)

    products = {each["name"]: each for each in info["products"]}
    absent = {each["name"]: each["reason"] for each in info["absent_products"]}
    assert products["range-disagreement"]["stated"]["failure"] == "Noise makes it larger, too."
    assert products["range"]["stated"] is None
    assert "package_that_is_not_there" in absent["missing"]
    assert "not 'range'" not in absent.get("range", "")
    assert streamed.product in ("range", "range-disagreement")
    assert (apart.unit, apart.array.shape) == ("m", moments.array.shape[1:])
    assert 0 <= np.nanmax(apart.array) < 5e-3  # of one return; a step of an image is 1 mm
    assert picture.headers["Transientcam-Unit"] == "mm"
    assert "range-disagreement" in asyncapi
    in_viewer = np.frombuffer(viewed.data, "<f4").reshape(apart.array.shape)
    assert in_viewer == pytest.approx(apart.array, abs=5e-3)
    assert b"images/range-disagreement" in logged


def test_a_recording_has_their_products(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output, recorded = tmp_path / "out.npz", record(tmp_path / "a.h5", 1)
    asked = ["reconstruct", str(recorded), "-o", str(output), "--product", "range-disagreement"]

    assert command(asked) == 0, capsys.readouterr().err

    with np.load(output) as found, transientcam.open(recorded) as frames:
        from_file, b = found["range-disagreement"][0], frames[0].reconstruction.smoothed
        f_hz = frames[0].recipe.base_frequency_hz
    # brute force: the whole turns that bring each range next to the lowest frequency's
    turns_m = [299_792_458 / (2 * j * f_hz) for j in range(1, len(b))]
    range_m = [
        np.angle(plane) / (2 * np.pi) * turn_m for plane, turn_m in zip(b[1:], turns_m, strict=True)
    ]
    apart_m = [
        np.min([np.abs(each - range_m[0] + k * turn_m) for k in range(-9, 10)], axis=0)
        for each, turn_m in zip(range_m, turns_m, strict=True)
    ]
    assert from_file == pytest.approx(np.max(apart_m, axis=0), abs=1e-4)
    mcap = tmp_path / "a.mcap"
    product = ["--product", "range-disagreement"]
    assert command(["convert", str(recorded), "-o", str(mcap), *product]) == 0
    with mcap.open("rb") as file:
        messages = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        (image,) = (each for _, channel, _, each in messages if channel.topic == f"/{product[1]}")
    assert np.array_equal(np.frombuffer(image.data, "<f4"), from_file.ravel(), equal_nan=True)
    assert command([*asked[:-1], "missing"]) != 0
    assert "package_that_is_not_there" in capsys.readouterr().err


def test_plans_predict_with_it_what_captures_show() -> None:
    """The oracle draws images of a sensor's data sheet, and makes moments of them by hand."""
    fixed: dict[str, Any] = {"harmonics": 3, "base_frequency_hz": 20e6, "zeroth": "estimated"}
    fixed |= {"exposure_s": 5e-4, "takes": 1, "sub_phases": {"scheme": "none"}}
    sheet = {"gain_e_per_dn": 9.0, "read_noise_e": 30.0}
    given = {"brightness_dn_per_s": 2e6, "returns": [{"range_m": 2.0}]}
    wanted: dict[str, Any] = {"budget": {"capture_s": 1.0}, "fixed": fixed, "scene": given}
    with serving("sim:wall", sensor=sheet) as served, Camera(served.url, timeout_s=600.0) as camera:
        camera.reconstruction = {"neighbours": "none"}
        plan = camera.plan(**wanted, estimator="matched-filter")
        problems = []
        for name in ("raises", "absent", "nonsense"):
            with pytest.raises(ProblemError) as refused:
                camera.plan(**wanted, estimator=name)
            problems.append((refused.value.status, refused.value.document["field"]))
    random, j = np.random.default_rng(5), np.arange(1, 4)[:, None, None]
    phase_rad = np.pi / 2 * np.arange(4)[:, None]
    seen = np.exp(4j * np.pi * 20e6 * j * 2.0 / 299_792_458.0 - 1j * phase_rad)
    light_dn = np.broadcast_to(1000.0 * (1 + np.real(seen)) / 2, (3, 4, 4000))
    noise_dn = np.sqrt(light_dn / 9.0 + (30.0 / 9.0) ** 2 + 1 / 12)
    images = light_dn + noise_dn * random.standard_normal(light_dn.shape)
    b = np.concatenate([np.full((1, 4000), 1000.0), (images * np.exp(1j * phase_rad)).sum(axis=1)])
    range_m = tm.range_m(comparisons.technique_of("matched-filter").of(b).first_phase_rad(), 20e6)
    assert plan["estimator"] == "matched-filter"
    predicted = plan["predicted"]["range_std_m"]["median"]
    assert predicted == pytest.approx(np.std(range_m), rel=0.1)
    assert problems == [(409, "estimator"), (409, "estimator"), (422, "estimator")]


def test_a_front_is_of_the_estimator_that_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    scene = ["--brightness-dn-per-s", "1e6", "--front", "--json"]

    assert command(["plan", *scene, "--estimator", "matched-filter"]) == 0, capsys.readouterr().err

    found = json.loads(capsys.readouterr().out)
    assert {each["estimator"] for each in found["front"] + found["lines"]} == {"matched-filter"}
    assert command(["plan", *scene, "--estimator", "nonsense"]) == 2
    assert "matched-filter" in capsys.readouterr().err


def test_the_doctor_says_which_can_be_used() -> None:
    found = {message: level for level, _, message, _ in doctor._plugins()}

    assert found["matched-filter, of another package: matched filter"] == "ok"
    assert [found[each] for each in found if "package_that_is_not_there" in each] == ["warning"] * 2
    assert any("product range of another package failed: its name is" in each for each in found)
    assert any("range-disagreement, of another package: how far" in each for each in found)


def test_a_recording_is_reconstructed_by_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, output = tmp_path / "moments.npz", tmp_path / "out.npz"
    np.savez(file, moments=MOMENTS.reshape(5, 1, 2), base_frequency_hz=20e6)

    code = command(["reconstruct", str(file), "-o", str(output), "--estimator", "matched-filter"])

    assert code == 0, capsys.readouterr().err
    with np.load(output) as found:
        assert found["range_m"].ravel() == pytest.approx(tm.range_m(PHASE_RAD, 20e6), abs=1e-4)


def test_they_are_held_against_built_in_ones_by_one_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "errors.png"
    against = ["--against", "single-frequency", "--scene", "wall", "--harmonics", "2"]

    code = command(["compare", "raises", "matched-filter", *against, "--plot", str(picture)])

    scene, *lines = capsys.readouterr().out.splitlines()
    assert code == 1  # one of those it was asked about failed
    assert scene.startswith("wall: ")
    assert [line.split()[0] for line in lines] == ["matched-filter", "single-frequency", "raises"]
    assert 0 < float(lines[0].split()[1]) < float(lines[1].split()[1]) < 100
    assert "ZeroDivisionError: by hand" in lines[2]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert command(["compare", "nonsense"]) == 2


def test_the_page_shows_the_package_that_is_tested() -> None:
    page = PAGE.read_text("utf-8")

    for file in (*EXAMPLE.glob("*.*"), MAP_EXAMPLE / "range_disagreement.py"):
        if file.suffix in (languages := {".toml": "toml", ".py": "python"}):
            assert f"```{languages[file.suffix]}\n{file.read_text('utf-8')}```" in page
            assert len(file.read_text("utf-8").splitlines()) <= 40
