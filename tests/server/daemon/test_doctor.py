"""The server's checks of `transientcam doctor`."""

import resource
import shutil
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import NoReturn

import pytest

import transientcam_moments as tm
from tests.serving import serving
from transientcam_moments._gpu import Adapter
from transientcam_server.daemon import _doctor as doctor
from transientcam_server.daemon._configuration import ENVIRONMENT_PREFIX
from transientcam_server.daemon._doctor import Reported, checks

GPU = Adapter("Big GPU", "DiscreteGPU", "Vulkan", "1.0")


@pytest.fixture(autouse=True)
def clean(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import os

    for name in [name for name in os.environ if name.startswith(ENVIRONMENT_PREFIX)]:
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setattr(tm.kernels, "devices", lambda check: [GPU])


def found(config: Path | None = None) -> dict[str, Reported]:
    return {each[1]: each for each in checks(config)}


def settings(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "lab.toml"
    file.write_text(text)
    return file


def test_a_machine_that_is_set_up_has_no_faults(tmp_path: Path) -> None:
    seen = found(settings(tmp_path, "port = 0\n"))

    assert {each[0] for each in seen.values()} <= {"ok", "warning"}
    assert "numba" in seen["packages"][2]
    assert set(seen) == {
        *("packages", "kernels", "devices", "supervisor", "settings", "recordings", "calibrations"),
        *("light", "tokens", "disk", "files", "port"),
    }


def test_a_place_where_nothing_can_be_kept_of_the_light_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file", encoding="utf-8")
    file = settings(tmp_path, f"[light]\ndirectory = '{tmp_path}/state/light'\n")

    level, _, message, remedy = found(file)["light"]

    assert (level, str(tmp_path / "state") in message) == ("fault", True)
    assert remedy is not None
    assert "light.directory" in remedy


def test_every_mistake_in_the_settings_is_a_fault_with_its_place(tmp_path: Path) -> None:
    file = settings(tmp_path, "port = -1\n[stream]\nqueue_frames = 99\n")

    faults = [each for each in checks(file) if each[0] == "fault"]

    assert [each[1] for each in faults] == ["settings", "settings"]
    reported = " ".join(each[2] for each in faults)
    assert "port" in reported
    assert "stream.queue_frames" in reported


def test_a_service_that_admits_every_client_is_warned_of(tmp_path: Path) -> None:
    everybody = found(settings(tmp_path, 'host = "0.0.0.0"\nport = 0\ninsecure = true\n'))
    local = found(settings(tmp_path, "port = 0\ninsecure = true\n"))

    assert everybody["access"][0] == "warning"
    assert "access" not in local


def test_devices_are_named_with_what_they_make_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    assert found()["devices"][:3] == ("ok", "devices", "Big GPU (DiscreteGPU, Vulkan) can be used")

    monkeypatch.setattr(tm.kernels, "devices", lambda check: [GPU._replace(refused="it is wrong")])
    wrong = found()["devices"]

    def none(check: int) -> NoReturn:
        raise tm.DeviceUnavailable("gpu", "wgpu is not installed")

    monkeypatch.setattr(tm.kernels, "devices", none)
    missing = found()["devices"]

    assert wrong == ("warning", "devices", "it is wrong", "docs/gpu.md")
    assert missing[0] == "ok"
    assert "computed on the processor: wgpu is not installed" in missing[2]


def test_kernels_are_counted_where_they_are_kept(tmp_path: Path) -> None:
    before = found()["kernels"]
    kept = next((tmp_path / "kernels").iterdir()) / "made"
    kept.mkdir()
    (kept / "density.nbi").touch()
    after = found()["kernels"]

    assert (before[0], before[3]) == ("warning", "transientcam compile does it now")
    assert after[0] == "ok"
    assert after[2].startswith("1 functions")


def test_kernels_that_can_be_kept_nowhere_or_are_off_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    nowhere = found()["kernels"]
    monkeypatch.setattr(tm.kernels, "state", lambda: {"enabled": False})
    off = found()["kernels"]

    assert (nowhere[0], off[0]) == ("warning", "warning")
    assert "nowhere to keep" in nowhere[2]
    assert "TRANSIENTCAM_KERNELS" in off[2]


def test_a_directory_that_cannot_be_written_into_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    file = settings(tmp_path, f'[recordings]\ndirectory = "{tmp_path / "file" / "below"}"\n')

    level, _, message, remedy = found(file)["recordings"]

    assert level == "fault"
    assert str(tmp_path / "file") in message
    assert "recordings.directory" in str(remedy)


def test_looking_leaves_nothing_behind(tmp_path: Path) -> None:
    file = settings(tmp_path, f'[recordings]\ndirectory = "{tmp_path / "a" / "b"}"\n')

    assert found(file)["recordings"][0] == "ok"
    assert not (tmp_path / "a").exists()


def test_a_disk_too_full_to_record_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=10**9))

    level, _, message, _ = found()["disk"]

    assert level == "warning"
    assert message.startswith("1.0 GB free")


def test_too_few_descriptors_for_the_connections_allowed_are_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (256, 256))

    level, _, _, remedy = found()["files"]

    assert level == "warning"
    assert "ulimit -n 576" in str(remedy)


def test_a_port_that_another_program_has_is_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_ASK_S", 0.05)  # it never answers
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        other.close()
        with socket.create_server(("127.0.0.1", port)):
            level, _, message, remedy = found(settings(tmp_path, f"port = {port}\n"))["port"]

    assert level == "fault"
    assert str(port) in message
    assert str(port) in str(remedy)


def test_a_port_that_a_daemon_has_already_is_none(tmp_path: Path) -> None:
    with serving("sim:wall?noise=off") as served:
        port = served.url.rpartition(":")[2]
        level, _, message, _ = found(settings(tmp_path, f"port = {port}\n"))["port"]

    assert level == "ok"
    assert f"serves at {served.url}" in message
