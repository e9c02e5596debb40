"""Where settings come from, and the errors for those that cannot be used."""

from pathlib import Path

import pytest

from transientcam_server.api import Role, utc_now
from transientcam_server.api._auth.tokens import TokenFile
from transientcam_server.daemon import load as load_with_places, load_settings
from transientcam_server.daemon._configuration import OTHER_VARIABLES
from transientcam_server.errors import SettingsError
from transientcam_server.settings import Settings


@pytest.fixture(autouse=True)
def nothing_set(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))  # where no token is


def load(
    *, file: Path | None = None, environment: dict[str, str] | None = None, **command_line: object
) -> Settings:
    return load_settings(command_line, file=file, environment=environment or {})


def test_without_anything_given_the_defaults_hold() -> None:
    settings = load()

    assert (settings.camera, settings.host, settings.port) == ("sim:mirrors", "127.0.0.1", 8000)
    assert settings.reconstruction.smoothing_px == 0.6
    assert settings.reconstruction.bias == 4e-3


def test_command_line_wins_over_environment_wins_over_file(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text('port = 1\ncamera = "usb"\nlog_level = "debug"\n')

    settings = load(
        file=file,
        environment={"TRANSIENTCAM_PORT": "2", "TRANSIENTCAM_CAMERA": "sim:wall"},
        port=3,
        camera=None,
    )

    assert (settings.port, settings.camera, settings.log_level) == (3, "sim:wall", "debug")


def test_one_value_of_a_table_from_the_environment_leaves_the_others_of_the_file(
    tmp_path: Path,
) -> None:
    file = tmp_path / "a.toml"
    file.write_text("[stream]\nmax_clients = 5\nqueue_frames = 3\n")

    settings = load(file=file, environment={"TRANSIENTCAM_STREAM__MAX_CLIENTS": "8"})

    assert (settings.stream.max_clients, settings.stream.queue_frames) == (8, 3)


def test_the_file_in_the_working_directory_is_found(tmp_path: Path) -> None:
    (tmp_path / "transientcam.toml").write_text("port = 8123\n")

    assert load().port == 8123


def test_every_mistake_is_listed_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text("bogus = 2\n[reconstruction]\nbias = -1.0\nfoo = 1\n")

    with pytest.raises(SettingsError) as caught:
        load(file=file, environment={"TRANSIENTCAM_STREAM__QUEUE_FRAMES": "many"}, port=99999)

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


def test_mistakes_of_every_source_are_reported_together_also_beside_a_broken_file(
    tmp_path: Path,
) -> None:
    file = tmp_path / "broken.toml"
    file.write_text("port = 1\nhost = \n")
    environment = {
        "TRANSIENTCAM_STREAM": "{broken",
        "TRANSIENTCAM_PROT": "8765",
        "TRANSIENTCAM_ALLOWED_HOSTS": "lab.example",
        "TRANSIENTCAM_WORKERS": "1",
    }

    with pytest.raises(SettingsError) as caught:
        load(file=file, environment=environment, port=-1)

    reported = {mistake.place: mistake.reason for mistake in caught.value.mistakes}
    assert set(reported) == {str(file), "--port", *environment}
    assert "line 2" in reported[str(file)]
    assert reported["TRANSIENTCAM_PROT"].endswith("did you mean TRANSIENTCAM_PORT?")
    assert "JSON" in reported["TRANSIENTCAM_ALLOWED_HOSTS"]


def test_what_is_unsafe_and_what_cannot_be_served_are_reported_together(tmp_path: Path) -> None:
    with pytest.raises(SettingsError) as caught:
        load(host="0.0.0.0", tls_certificate=tmp_path / "absent.pem")

    assert [each.place for each in caught.value.mistakes] == ["--host", "--tls-certificate"]


@pytest.mark.parametrize(
    ("text", "place", "meant"),
    [
        ("colour = 1", "colour", ""),
        ("[stream]\nmax_client = 8", "stream.max_client", "did you mean max_clients?"),
        ("[streams]\nmax_clients = 8", "streams", "did you mean stream?"),
        ("stream = 8", "stream", ""),
        ("allowed_hosts = [1]", "allowed_hosts", ""),
    ],
)
def test_a_mistake_in_a_file_is_reported_with_its_key_and_what_may_have_been_meant(
    tmp_path: Path, text: str, place: str, meant: str
) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text)

    with pytest.raises(SettingsError) as caught:
        load(file=file)

    (mistake,) = caught.value.mistakes
    assert mistake.place == f"{file}: {place}"
    assert mistake.reason.endswith(meant)


def test_variables_for_others_are_left_to_them() -> None:
    environment = dict.fromkeys(OTHER_VARIABLES, "x") | {"PATH": "/bin", "_TRANSIENTCAM_X": "1"}

    assert load(environment=environment) == load()


def test_lists_and_tables_are_json_in_the_environment() -> None:
    settings = load(
        environment={
            "TRANSIENTCAM_ALLOWED_HOSTS": '["lab.example", "bench-2"]',
            "transientcam_stream": '{"max_clients": 8}',
            "TRANSIENTCAM_STREAM__QUEUE_FRAMES": "3",
        }
    )

    assert settings.allowed_hosts == ("lab.example", "bench-2")
    assert (settings.stream.max_clients, settings.stream.queue_frames) == (8, 3)


def test_each_setting_has_where_it_was_given(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text('camera = "usb"\nport = 1\n[stream]\nmax_clients = 5\n')

    places = load_with_places(
        {"port": 3, "host": None}, file=file, environment={"TRANSIENTCAM_STREAM__QUEUE_FRAMES": "3"}
    ).places

    assert places.given(("port",)) == "--port"
    assert places.given(("camera",)) == f"{file}: camera"
    assert places.given(("stream", "max_clients")) == f"{file}: stream.max_clients"
    assert places.given(("stream", "queue_frames")) == "TRANSIENTCAM_STREAM__QUEUE_FRAMES"
    assert places.given(("host",)) is None
    assert places.given(("stream", "first_message_s")) is None


@pytest.mark.parametrize("content", [b"port = ", b"\xff\xfe", b"a = [1"])
def test_a_file_that_is_no_toml_is_named(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "broken.toml"
    file.write_bytes(content)

    with pytest.raises(SettingsError, match=r"broken\.toml"):
        load(file=file)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"absent\.toml.*cannot be read"):
        load(file=tmp_path / "absent.toml")


def test_a_variable_that_is_no_json_where_a_table_belongs_is_a_settings_error() -> None:
    with pytest.raises(SettingsError, match="TRANSIENTCAM_STREAM: must be JSON"):
        load(environment={"TRANSIENTCAM_STREAM": "{broken"})


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab.example"])
def test_an_address_others_can_reach_needs_insecure(host: str) -> None:
    with pytest.raises(SettingsError, match=r"--host.*--insecure"):
        load(host=host)

    assert load(host=host, insecure=True).host == host


def test_a_token_makes_an_address_others_can_reach_safe(tmp_path: Path) -> None:
    path = tmp_path / "tokens.json"
    TokenFile(path).create("a", Role.VIEWER, now=utc_now())

    settings = load(host="0.0.0.0", tokens_file=path)

    assert settings.needs_token


def test_asking_for_tokens_where_there_are_none_would_lock_every_client_out() -> None:
    with pytest.raises(SettingsError, match=r"REQUIRE_TOKEN.*token create"):
        load(environment={"TRANSIENTCAM_REQUIRE_TOKEN": "true"})


def test_asking_for_tokens_and_for_none_contradict_each_other() -> None:
    with pytest.raises(SettingsError, match="contradicts"):
        load(insecure=True, require_token=True)


def test_a_relay_with_a_token_asks_for_tokens_or_is_told_not_to(tmp_path: Path) -> None:
    path, mine = tmp_path / "tokens.json", tmp_path / "lab.token"
    TokenFile(path).create("a", Role.VIEWER, now=utc_now())
    mine.write_text("secret of the origin")
    with_token = {"TRANSIENTCAM_RELAY_TOKEN": "secret of the origin"}
    for camera, environment in (
        ("relay:http://lab:8000", with_token),
        (f"relay:http://lab:8000?token_file={mine}", {}),
    ):
        with pytest.raises(SettingsError, match=r"--camera.*require_token") as refused:
            load(camera=camera, environment=environment)
        assert "secret of the origin" not in str(refused.value)
        load(camera=camera, environment=environment, insecure=True)
        load(camera=camera, environment=environment, require_token=True, tokens_file=path)

    load(camera="relay:http://lab:8000")
    load(camera="sim:wall", environment=with_token)


def test_a_file_of_tokens_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    path = tmp_path / "tokens.json"
    path.write_text("{")

    with pytest.raises(SettingsError, match=r"tokens-file.*tokens\.json"):
        load(host="0.0.0.0", tokens_file=path)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_a_loopback_address_needs_nothing(host: str) -> None:
    assert load(host=host).on_loopback


@pytest.mark.parametrize("value", ["nan", "inf", "-0.1"])
def test_a_number_must_be_finite_and_in_range(value: str) -> None:
    with pytest.raises(SettingsError, match="SMOOTHING_PX"):
        load(environment={"TRANSIENTCAM_RECONSTRUCTION__SMOOTHING_PX": value})


def test_settings_are_frozen() -> None:
    settings = load()

    with pytest.raises(ValueError, match="frozen"):
        settings.port = 1


@pytest.fixture
def homeless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Be a user that no password file knows, without HOME and all that may stand in for it."""
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "STATE_DIRECTORY"):
        monkeypatch.delenv(name, raising=False)

    def unknown(*_: object) -> None:
        raise KeyError("uid not found")

    monkeypatch.setattr("pwd.getpwuid", unknown)


@pytest.mark.usefixtures("homeless")
def test_a_user_without_a_home_is_told_which_settings_are_missing() -> None:
    with pytest.raises(SettingsError) as caught:
        load()

    places = [each.place for each in caught.value.mistakes]
    stated = ["tokens_file", "recordings.directory", "calibrations.directory", "light.directory"]
    assert places == stated
    assert "HOME" in str(caught.value)


@pytest.mark.usefixtures("homeless")
def test_a_user_without_a_home_needs_none_where_the_directories_are_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path))
    tokens = str(tmp_path / "tokens.json")

    settings = load(environment={"TRANSIENTCAM_TOKENS_FILE": tokens})

    assert settings.tokens_file == Path(tokens)
    assert settings.recordings.directory == tmp_path / "recordings"


def test_what_kubernetes_sets_for_a_service_of_the_same_name_is_no_setting() -> None:
    links = {"TRANSIENTCAM_PORT": "tcp://10.0.0.7:8000", "TRANSIENTCAM_SERVICE_HOST": "10.0.0.7"}
    links |= {"TRANSIENTCAM_PORT_8000_TCP_PROTO": "tcp", "TRANSIENTCAM_HOST": "127.0.0.2"}

    settings = load(environment=links)

    assert (settings.host, settings.port) == ("127.0.0.2", 8000)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("[lens]\nfield_of_view_deg = 60.0\nfx_px = 200.0", "give one of them"),
        ("[lens]\ncx_px = 10.0", "cx_px must stand beside fx_px"),
        ("[lens]\nfx_px = 200.0\ndistortion = [0.1, 0.2]", "5 numbers or none, not 2"),
        ("[lens]\nlight_x_m = 300.0", "less than or equal to 10"),
        ("[history]\nseconds = false", "not true or false"),
        ("port = true", "not true or false"),
        ("[lens]\nfx_px = 200.0\ndistortion = [0.1, 0, 0, 0, true]", "not true or false"),
        ('root_path = "lidar/"', "match pattern"),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path: Path, lines: str, said: str) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(lines)

    with pytest.raises(SettingsError, match=said):
        load_settings({}, file=file, environment={})
