"""The file of tokens."""

import hashlib
import json
import stat
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from transientcam_server.api import TokenFile
from transientcam_server.api._auth import Role
from transientcam_server.errors import TokenFileError, UnknownToken

NOW = datetime(2030, 1, 1, tzinfo=UTC)


@pytest.fixture
def file(tmp_path: Path) -> TokenFile:
    return TokenFile(tmp_path / "deep" / "tokens.json")


def test_a_file_that_is_not_there_holds_no_token(file: TokenFile) -> None:
    assert not file
    assert file.find("tcam_00000000_x", now=NOW) is None


def test_a_token_is_found_by_itself_and_by_nothing_near_it(file: TokenFile) -> None:
    token, text = file.create("bench 2", Role.OPERATOR, now=NOW)

    found = file.find(text, now=NOW)

    assert found == token
    assert (token.name, token.rank) == ("bench 2", Role.OPERATOR)
    for wrong in (text[:-1], text + "a", text.upper(), text.replace("tcam", "xcam"), "", "ü", "_"):
        assert file.find(wrong, now=NOW) is None
    assert file.find(f"tcam_{token.id}_", now=NOW) is None
    assert file.find(f"tcam_{token.id}", now=NOW) is None


def test_what_is_kept_is_not_the_token(file: TokenFile) -> None:
    token, text = file.create("a", Role.VIEWER, now=NOW)

    kept = file.path.read_text()

    assert text.split("_", 2)[2] not in kept
    assert hashlib.sha256(text.encode()).hexdigest() in kept
    assert token.sha256 not in repr(token)


def test_a_token_has_256_bits_that_no_other_has(file: TokenFile) -> None:
    texts = {file.create("a", Role.VIEWER, now=NOW)[1] for _ in range(8)}

    assert len(texts) == 8
    assert all(len(text.split("_", 2)[2]) == 43 for text in texts)  # base64 of 32 bytes


def test_no_other_user_may_read_the_file(file: TokenFile) -> None:
    file.create("a", Role.VIEWER, now=NOW)

    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600
    assert stat.S_IMODE(file.path.parent.stat().st_mode) == 0o700
    assert [path.name for path in file.path.parent.iterdir()] == ["tokens.json"]


def test_a_revoked_token_is_one_no_more_and_the_others_stay(file: TokenFile) -> None:
    first, first_text = file.create("a", Role.VIEWER, now=NOW)
    _, second_text = file.create("b", Role.ADMIN, now=NOW)

    file.revoke(first.id)

    assert file.find(first_text, now=NOW) is None
    assert not file.has(first.id, now=NOW)
    assert file.find(second_text, now=NOW) is not None
    with pytest.raises(UnknownToken, match=first.id):
        file.revoke(first.id)


def test_a_token_expires(file: TokenFile) -> None:
    day = timedelta(days=1)
    token, text = file.create("a", Role.VIEWER, now=NOW, expires=NOW + day)

    assert file.find(text, now=NOW + day - timedelta(seconds=1)) == token
    assert file.find(text, now=NOW + day) is None
    assert not file.has(token.id, now=NOW + day)


def test_another_process_sees_what_changed(file: TokenFile) -> None:
    other = TokenFile(file.path)
    assert not other

    token, text = file.create("a", Role.VIEWER, now=NOW)
    assert other.find(text, now=NOW) == token
    file.revoke(token.id)
    assert other.find(text, now=NOW) is None
    file.path.unlink()
    assert not other.tokens()


def test_tokens_made_at_the_same_time_are_all_kept(file: TokenFile) -> None:
    with ThreadPoolExecutor(8) as executor:
        made = [
            executor.submit(TokenFile(file.path).create, f"n{i}", Role.VIEWER, now=NOW)
            for i in range(16)
        ]
        texts = [each.result()[1] for each in made]

    assert all(file.find(text, now=NOW) is not None for text in texts)


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        '{"v": 2, "tokens": []}',
        '{"v": 1, "tokens": [{"id": "x"}]}',
        '{"v": 1, "tokens": [], "more": 1}',
    ],
)
def test_a_file_that_cannot_be_used_admits_no_client(file: TokenFile, content: str) -> None:
    _, text = file.create("a", Role.VIEWER, now=NOW)
    assert file.find(text, now=NOW) is not None

    file.path.write_text(content)

    for _ in range(2):  # each time, not only when it has just changed
        with pytest.raises(TokenFileError, match=r"tokens\.json"):
            file.find(text, now=NOW)
    with pytest.raises(TokenFileError):
        file.create("b", Role.VIEWER, now=NOW)
    assert file.path.read_text() == content


def test_a_secret_in_a_broken_file_is_not_repeated_in_the_error(file: TokenFile) -> None:
    file.path.parent.mkdir()
    file.path.write_text(json.dumps({"v": 1, "tokens": [{"id": "x", "sha256": "geheim"}]}))

    with pytest.raises(TokenFileError) as caught:
        file.tokens()

    assert "geheim" not in str(caught.value)


def test_a_directory_in_its_place_is_reported_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(TokenFileError, match="directory"):
        TokenFile(tmp_path).tokens()


def test_roles_are_ordered() -> None:
    assert Role.VIEWER < Role.OPERATOR < Role.ADMIN
    assert [Role.named(str(role)) for role in Role] == list(Role)


@pytest.mark.parametrize("role", Role)
def test_a_token_of_before_the_right_to_light_has_it_as_its_role_has(
    file: TokenFile, role: Role
) -> None:
    _, text = file.create("a", role, now=NOW)
    document = json.loads(file.path.read_bytes())
    del document["tokens"][0]["may_light"]
    file.path.write_text(json.dumps(document), encoding="utf-8")

    token = file.find(text, now=NOW)

    assert token is not None
    assert token.lights == (role is not Role.VIEWER)


def test_a_viewer_may_not_light_whatever_the_file_says(file: TokenFile) -> None:
    _, text = file.create("a", Role.VIEWER, now=NOW)
    document = json.loads(file.path.read_bytes())
    document["tokens"][0]["may_light"] = True
    file.path.write_text(json.dumps(document), encoding="utf-8")

    token = file.find(text, now=NOW)

    assert token is not None
    assert not token.lights
