"""What can be said of docker/ without building it; the scripts beside it do that for real."""

import os
import re
import shutil
import subprocess
import sys
from typing import Any

import pytest
import yaml

from tests.conftest import ROOT
from transientcam_server.daemon import load_settings
from transientcam_server.daemon._announcement import inside_container
from transientcam_server.errors import SettingsError

_DOCKER = ROOT / "docker"
_OURS = ("simulated", "usb", "camera-behind-tls")


def services() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((_DOCKER / "compose.yaml").read_text())["services"]
    return found


def image_environment() -> dict[str, str]:
    """Return the variables that the image sets."""
    text = (_DOCKER / "Dockerfile").read_text().replace("\\\n", " ")
    (line,) = [each for each in text.splitlines() if each.startswith("ENV ")]
    return dict(re.findall(r"(\w+)=(\S+)", line.removeprefix("ENV ")))


def test_the_services_are_written_as_the_compose_specification_has_it() -> None:
    """check-jsonschema carries the schema that compose itself checks files with."""
    command = ["check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    checked = subprocess.run(
        [sys.executable, "-m", *command, _DOCKER / "compose.yaml"],
        capture_output=True,
        text=True,
        check=False,
    )

    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize("name", _OURS)
def test_a_camera_s_container_can_write_nowhere_but_where_it_has_to(name: str) -> None:
    service = services()[name]

    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert not service.get("privileged", False)
    assert "devices" not in service
    written = [each for each in service["volumes"] if not each.endswith(":ro")]
    mounts = {each.split(":")[1] for each in written} - {"/dev/bus/usb"}
    assert mounts == {"/var/lib/transientcam", "/var/cache/transientcam"}


@pytest.mark.parametrize("name", ["simulated", "usb"])
def test_a_service_without_tokens_is_reached_from_this_machine_alone(name: str) -> None:
    assert services()[name]["ports"] == ["127.0.0.1:8000:8000"]


def test_a_service_that_others_reach_requires_tokens_behind_tls() -> None:
    service = services()["camera-behind-tls"]

    assert "ports" not in service
    assert service["environment"]["TRANSIENTCAM_REQUIRE_TOKEN"] == "true"
    caddyfile = (_DOCKER / "Caddyfile").read_text()
    assert "reverse_proxy camera-behind-tls:8000" in caddyfile


@pytest.mark.parametrize("name", _OURS)
def test_the_settings_of_a_container_are_settings(name: str) -> None:
    given = {
        key: re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", value)
        for key, value in services()[name]["environment"].items()
    }
    environment = image_environment() | given

    try:
        settings = load_settings({}, environment=environment)
    except SettingsError as error:  # there is no token yet
        (mistake,) = error.mistakes
        assert mistake.place == "TRANSIENTCAM_HOST"
        assert "token create" in mistake.reason
        assert name == "camera-behind-tls"
    else:
        assert settings.host == "0.0.0.0"
        assert settings.camera in ("sim:mirrors", "usb")


@pytest.mark.parametrize("name", ["scheduler", "worker"])
def test_a_cluster_writes_recordings_and_kernels_alone_and_is_this_machine_s(name: str) -> None:
    service = services()[name]

    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    mounts = {each.rpartition(":")[2] for each in service["volumes"]}
    assert mounts == {"/recordings", "/var/cache/transientcam"}
    assert all(each.startswith("127.0.0.1:") for each in service.get("ports", []))


def test_a_cluster_s_image_has_dask_and_its_store_the_same_secret() -> None:
    found = services()
    store, worker = found["s3"]["environment"], found["worker"]["environment"]

    assert "-r requirements/service.txt" in (_DOCKER / "Dockerfile").read_text()
    assert "\ndistributed==" in (ROOT / "requirements" / "service.txt").read_text()
    assert found["s3"]["ports"] == ["127.0.0.1:9000:9000"]
    assert worker["AWS_ACCESS_KEY_ID"] == store["MINIO_ROOT_USER"]
    assert worker["AWS_SECRET_ACCESS_KEY"] == store["MINIO_ROOT_PASSWORD"]


def test_the_image_alone_admits_no_client_without_a_token() -> None:
    with pytest.raises(SettingsError, match="clients will need a token"):
        load_settings({}, environment=image_environment())


def test_the_image_is_known_as_a_container() -> None:
    assert inside_container(image_environment(), root=_DOCKER)


def test_every_image_of_others_is_named_by_its_digest() -> None:
    """A tag is another image each time its registry makes it anew."""
    bases = re.findall(
        r"^ARG BASE=(.+)$",
        "\n".join((_DOCKER / each / "Dockerfile").read_text() for each in (".", "ros2")),
        re.MULTILINE,
    )
    served = [each["image"] for each in services().values() if "build" not in each]

    assert len(bases) == 2
    assert len(served) >= 2
    for image in (*bases, *served):
        assert re.search(r"@sha256:[0-9a-f]{64}\}?$", image), image


def test_usb_comes_by_a_rule_that_replugging_survives() -> None:
    usb = services()["usb"]

    assert usb["device_cgroup_rules"] == ["c 189:* rmw"]
    assert "/dev/bus/usb:/dev/bus/usb" in usb["volumes"]


def test_the_image_runs_as_a_user_of_its_own_and_has_a_readiness_check() -> None:
    text = (_DOCKER / "Dockerfile").read_text()

    assert re.search(r"^USER 10001:10001$", text, re.MULTILINE)
    assert "/readyz" in text[text.index("HEALTHCHECK") :]
    assert "STOPSIGNAL SIGTERM" in text


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize("name", ["build-and-check", "compose-check"])
def test_what_tries_it_out_is_a_script_that_says_how_to_run_it(name: str) -> None:
    script = _DOCKER / name

    assert os.access(script, os.X_OK)
    subprocess.run(["bash", "-n", script], check=True)
    wrong = subprocess.run([script, "--nonsense"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    assert f"\n  docker/{name}" in wrong.stdout
