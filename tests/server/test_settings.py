from pathlib import Path

import pytest

from transientcam_server.errors import SettingsError
from transientcam_server.settings import ENVIRONMENT_PREFIX, Settings, load_settings
from transientcam_server.tokens import Role, TokenFile, utc_now


@pytest.fixture(autouse=True)
def clean_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import os

    for name in list(os.environ):
        if name.startswith(ENVIRONMENT_PREFIX):
            monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))  # where no token is


def load(
    monkeypatch: pytest.MonkeyPatch,
    *,
    file: Path | None = None,
    environment: dict[str, str] | None = None,
    **command_line: object,
) -> Settings:
    for name, value in (environment or {}).items():
        monkeypatch.setenv(name, value)
    return load_settings(command_line, file=file, environment=environment or {})


def test_without_anything_given_the_defaults_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = load(monkeypatch)

    assert (settings.camera, settings.host, settings.port) == ("sim:mirrors", "127.0.0.1", 8000)
    assert settings.reconstruction.smoothing_px == 0.6
    assert settings.reconstruction.bias == 4e-3


def test_command_line_wins_over_environment_wins_over_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "a.toml"
    file.write_text('port = 1\ncamera = "usb"\nlog_level = "debug"\n')

    settings = load(
        monkeypatch,
        file=file,
        environment={"TRANSIENTCAM_PORT": "2", "TRANSIENTCAM_CAMERA": "sim:wall"},
        port=3,
        camera=None,
    )

    assert (settings.port, settings.camera, settings.log_level) == (3, "sim:wall", "debug")


def test_one_value_of_a_table_from_the_environment_leaves_the_others_of_the_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "a.toml"
    file.write_text("[stream]\nmax_clients = 5\nqueue_frames = 3\n")

    settings = load(monkeypatch, file=file, environment={"TRANSIENTCAM_STREAM__MAX_CLIENTS": "8"})

    assert (settings.stream.max_clients, settings.stream.queue_frames) == (8, 3)


def test_the_file_in_the_working_directory_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "transientcam.toml").write_text("port = 8123\n")

    assert load(monkeypatch).port == 8123


def test_every_mistake_is_listed_with_its_place(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "lab.toml"
    file.write_text("bogus = 2\n[reconstruction]\nbias = -1.0\nfoo = 1\n")

    with pytest.raises(SettingsError) as caught:
        load(
            monkeypatch,
            file=file,
            environment={"TRANSIENTCAM_STREAM__QUEUE_FRAMES": "many"},
            port=99999,
        )

    places = {mistake.place: mistake for mistake in caught.value.mistakes}
    assert set(places) == {
        "--port",
        "TRANSIENTCAM_STREAM__QUEUE_FRAMES",
        f"{file}: bogus",
        f"{file}: reconstruction.bias",
        f"{file}: reconstruction.foo",
    }
    assert places["--port"].value == 99999
    assert "no such setting" in places[f"{file}: bogus"].reason
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("content", [b"port = ", b"\xff\xfe", b"a = [1"])
def test_a_file_that_is_no_toml_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, content: bytes
) -> None:
    file = tmp_path / "broken.toml"
    file.write_bytes(content)

    with pytest.raises(SettingsError, match=r"broken\.toml"):
        load(monkeypatch, file=file)


def test_a_file_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"absent\.toml.*cannot be read"):
        load(monkeypatch, file=tmp_path / "absent.toml")


def test_a_variable_that_is_no_json_where_a_table_belongs_is_a_settings_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SettingsError, match="stream"):
        load(monkeypatch, environment={"TRANSIENTCAM_STREAM": "{broken"})


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab.example"])
def test_an_address_others_can_reach_needs_insecure(
    monkeypatch: pytest.MonkeyPatch, host: str
) -> None:
    with pytest.raises(SettingsError, match=r"--host.*--insecure"):
        load(monkeypatch, host=host)

    assert load(monkeypatch, host=host, insecure=True).host == host


def test_a_token_makes_an_address_others_can_reach_safe(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "tokens.json"
    TokenFile(path).create("a", Role.VIEWER, now=utc_now())

    settings = load(monkeypatch, host="0.0.0.0", tokens_file=path)

    assert settings.needs_token


def test_asking_for_tokens_where_there_are_none_would_lock_everybody_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SettingsError, match=r"REQUIRE_TOKEN.*token create"):
        load(monkeypatch, environment={"TRANSIENTCAM_REQUIRE_TOKEN": "true"})


def test_asking_for_tokens_and_for_none_contradict_each_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SettingsError, match="contradicts"):
        load(monkeypatch, insecure=True, require_token=True)


def test_a_file_of_tokens_that_cannot_be_read_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "tokens.json"
    path.write_text("{")

    with pytest.raises(SettingsError, match=r"tokens-file.*tokens\.json"):
        load(monkeypatch, host="0.0.0.0", tokens_file=path)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_a_loopback_address_needs_nothing(monkeypatch: pytest.MonkeyPatch, host: str) -> None:
    assert load(monkeypatch, host=host).on_loopback


@pytest.mark.parametrize("value", ["nan", "inf", "-0.1"])
def test_a_number_must_be_finite_and_in_range(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    with pytest.raises(SettingsError, match="SMOOTHING_PX"):
        load(
            monkeypatch,
            environment={"TRANSIENTCAM_RECONSTRUCTION__SMOOTHING_PX": value},
        )


def test_settings_are_frozen(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = load(monkeypatch)

    with pytest.raises(ValueError, match="frozen"):
        settings.port = 1
