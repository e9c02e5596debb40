"""https and wss, with a certificate made for the test."""

from pathlib import Path

import pytest
import trustme

from tests.serving import serving
from transientcam import Camera
from transientcam.errors import ServerUnreachable
from transientcam_server.daemon import load_settings
from transientcam_server.errors import SettingsError


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    directory = tmp_path_factory.mktemp("tls")
    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1")
    paths = {name: directory / f"{name}.pem" for name in ("authority", "chain", "key", "both")}
    authority.cert_pem.write_to_path(paths["authority"])
    for certificate in issued.cert_chain_pems:
        certificate.write_to_path(paths["chain"], append=True)
    issued.private_key_pem.write_to_path(paths["key"])
    issued.private_key_and_cert_chain_pem.write_to_path(paths["both"])
    return paths


def test_requests_and_streams_go_through_tls(
    files: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(files["authority"]))
    with serving(tls_certificate=files["chain"], tls_key=files["key"]) as served:
        assert served.url.startswith("https://")
        with Camera(served.url, timeout_s=60.0) as camera:
            camera.configure(harmonics=4)
            with camera.stream("flags") as stream:
                assert stream.receive().product == "flags"


def test_every_one_of_many_streams_opens(
    files: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Session tickets come when they come: about one stream in 300 once never opened."""
    monkeypatch.setenv("SSL_CERT_FILE", str(files["authority"]))
    with serving("sim:wall?noise=off", tls_certificate=files["both"]) as served:
        for _ in range(400):
            with Camera(served.url, timeout_s=60.0) as camera, camera.stream("flags") as stream:
                assert not stream.closed


def test_an_unknown_authority_is_not_trusted(files: dict[str, Path]) -> None:
    with (
        serving(tls_certificate=files["both"]) as served,
        Camera(served.url) as camera,
        pytest.raises(ServerUnreachable, match="certificate"),
    ):
        _ = camera.info


def test_settings_with_a_certificate_that_can_be_served_are_taken(
    files: dict[str, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)

    for given in (
        {"tls_certificate": files["both"]},
        {"tls_certificate": files["chain"], "tls_key": files["key"]},
    ):
        settings = load_settings(given, environment={})
        assert settings.tls_certificate == given["tls_certificate"]


@pytest.mark.parametrize(
    ("certificate", "key", "message"),
    [
        ("absent", None, "--tls-certificate"),
        ("chain", None, "--tls-certificate"),
        ("key", "key", "--tls-certificate"),
        (None, "key", "--tls-key.*certificate"),
    ],
)
def test_others_are_refused_by_name(
    files: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    certificate: str | None,
    key: str | None,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    paths = files | {"absent": tmp_path / "absent.pem"}
    given = {
        "tls_certificate": None if certificate is None else paths[certificate],
        "tls_key": None if key is None else paths[key],
    }

    with pytest.raises(SettingsError, match=message):
        load_settings(given, environment={})
