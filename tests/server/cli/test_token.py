"""The verbs `transientcam token create`, `list` and `revoke`."""

import json
from pathlib import Path
from typing import Any

import pytest

from transientcam.cli import run
from transientcam_server.api import utc_now
from transientcam_server.api._auth.tokens import TokenFile


@pytest.fixture(autouse=True)
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TokenFile:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "tokens.json"
    monkeypatch.setenv("TRANSIENTCAM_TOKENS_FILE", str(path))
    return TokenFile(path)


def create(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert run(["token", "create", "--json", *arguments]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def test_a_token_is_printed_alone_so_that_a_script_may_take_it(
    capsys: pytest.CaptureFixture[str], file: TokenFile
) -> None:
    assert run(["token", "create", "bench [2]"]) == 0

    printed = capsys.readouterr()
    token = file.find(printed.out.strip(), now=utc_now())
    assert token is not None
    assert (token.name, token.role, token.expires) == ("bench [2]", "viewer", None)
    assert "bench [2]" in printed.err


def test_a_token_has_the_role_and_the_end_asked_for(
    capsys: pytest.CaptureFixture[str], file: TokenFile
) -> None:
    document = create(capsys, "guest", "--role", "operator", "--days", "2")

    token = file.find(document["token"], now=utc_now())
    assert token is not None
    assert token.role == document["role"] == "operator"
    assert token.expires is not None
    assert (token.expires - token.created).days == 2
    assert "sha256" not in document


def test_a_list_shows_everything_but_the_tokens(
    capsys: pytest.CaptureFixture[str], file: TokenFile
) -> None:
    made = [create(capsys, "a"), create(capsys, "[b]", "--days", "0")]

    assert run(["token", "list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert run(["token", "list"]) == 0
    table = capsys.readouterr().out

    assert [each["id"] for each in listed] == [each["id"] for each in made]
    for each in made:
        secret = each["token"].split("_", 2)[2]
        assert secret not in table + json.dumps(listed)
        assert each["id"] in table
    assert "[b]" in table
    assert "(over)" in table


def test_an_empty_list_says_where_it_looked(
    capsys: pytest.CaptureFixture[str], file: TokenFile
) -> None:
    assert run(["token", "list"]) == 0

    assert str(file.path) in capsys.readouterr().out.replace("\n", "")


def test_a_revoked_token_is_gone(capsys: pytest.CaptureFixture[str], file: TokenFile) -> None:
    document = create(capsys, "a")

    assert run(["token", "revoke", document["id"], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["id"] == document["id"]
    assert not file
    assert run(["token", "revoke", document["id"]]) == 1
    assert document["id"] in capsys.readouterr().err


def test_the_file_may_be_named_on_the_command_line(
    capsys: pytest.CaptureFixture[str], file: TokenFile, tmp_path: Path
) -> None:
    create(capsys, "a", "--tokens-file", str(tmp_path / "other.json"))

    assert not file
    assert TokenFile(tmp_path / "other.json")


@pytest.mark.parametrize("name", ["", "x" * 81, "a\nb"])
def test_a_name_that_is_none_is_wrong_usage(name: str, file: TokenFile) -> None:
    assert run(["token", "create", name]) == 2
    assert not file


def test_a_token_may_light_unless_it_is_made_without_that_or_for_a_viewer(
    capsys: pytest.CaptureFixture[str], file: TokenFile
) -> None:
    operator = ("--role", "operator")
    made = [
        create(capsys, "a", *operator),
        create(capsys, "b", *operator, "--no-may-light"),
        create(capsys, "c"),
    ]

    assert [each["may_light"] for each in made] == [True, False, False]
    assert run(["token", "list"]) == 0
    rows = capsys.readouterr().out.splitlines()[1:]
    assert [row.split()[3] for row in rows] == ["yes", "no", "no"]
    assert run(["token", "create", "d", "--role", "viewer", "--may-light"]) == 2
    assert len(file.tokens()) == 3
