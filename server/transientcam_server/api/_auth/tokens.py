"""Tokens, which authenticate clients. The file of tokens keeps only their hashes.

A token is 256 random bits, so its SHA-256 cannot be searched for; a slow hash is for
passwords, which people choose, and would let any client keep this machine busy.
"""

import fcntl
import hashlib
import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import IntEnum
from pathlib import Path
from typing import Final

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError

from transientcam_server.errors import TokenFileError, UnknownToken

_PREFIX: Final = "tcam"
_NOT_A_TOKEN: Final = hashlib.sha256(b"").hexdigest()


class Role(IntEnum):
    """What a client may do; each role includes those below it."""

    VIEWER = 1
    """Look at everything, change nothing; and switch the light off."""
    OPERATOR = 2
    """Control the camera."""
    ADMIN = 3
    """Take over any lease, and delete what cannot be made again."""

    def __str__(self) -> str:
        return self.name.lower()

    @classmethod
    def named(cls, name: str) -> "Role":
        """Return the role of this name."""
        return cls[name.upper()]


class Token(BaseModel):
    """What is kept of a token."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str = Field(pattern=r"^[0-9a-f]{8}$")
    name: str = Field(min_length=1, max_length=80)
    role: str = Field(pattern=r"^(viewer|operator|admin)$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$", repr=False)
    created: AwareDatetime
    expires: AwareDatetime | None = None
    may_light: bool = True
    """As it was made; those of before there was this right have it."""

    @property
    def lights(self) -> bool:
        """Whether its bearer may do what switches the light on; a viewer never may."""
        return self.may_light and self.rank > Role.VIEWER

    @property
    def rank(self) -> Role:
        """The role as a rank that can be compared."""
        return Role.named(self.role)

    def expired(self, now: datetime) -> bool:
        """Return whether it is valid no more."""
        return self.expires is not None and now >= self.expires


class _Document(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    v: int = Field(default=1, ge=1, le=1)
    tokens: tuple[Token, ...] = ()


class TokenFile:
    """The tokens that are valid; read anew whenever the file has changed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen: tuple[int, ...] | None = None
        self._tokens: dict[str, Token] = {}

    def __bool__(self) -> bool:
        """Whether there is any token."""
        return bool(self.tokens())

    def tokens(self) -> tuple[Token, ...]:
        """Return what is kept of every token.

        Raises TokenFileError if the file cannot be read; no token is valid then.
        """
        self._refresh()
        return tuple(self._tokens.values())

    def find(self, text: str, *, now: datetime) -> Token | None:
        """Return the token that ``text`` is; None if it is none that is valid now.

        Raises TokenFileError as `tokens`.
        """
        self._refresh()
        parts = text.split("_", 2)
        token = self._tokens.get(parts[1]) if len(parts) == 3 else None
        expected = _NOT_A_TOKEN if token is None else token.sha256
        same = secrets.compare_digest(_digest(text), expected)
        return token if token is not None and same and not token.expired(now) else None

    def has(self, token_id: str, *, now: datetime) -> bool:
        """Return whether the token of this id is still valid. Raises TokenFileError as `tokens`."""
        self._refresh()
        token = self._tokens.get(token_id)
        return token is not None and not token.expired(now)

    def create(
        self,
        name: str,
        role: Role,
        *,
        now: datetime,
        expires: datetime | None = None,
        may_light: bool = True,
    ) -> tuple[Token, str]:
        """Make a token and return what is kept of it, and the token itself, which is not."""
        with self._changing() as tokens:
            token_id = secrets.token_hex(4)
            text = f"{_PREFIX}_{token_id}_{secrets.token_urlsafe(32)}"
            token = Token(
                id=token_id,
                name=name,
                role=str(role),
                sha256=_digest(text),
                created=now,
                expires=expires,
                may_light=may_light and role > Role.VIEWER,
            )
            tokens[token_id] = token
        return token, text

    def revoke(self, token_id: str) -> Token:
        """Make a token invalid. Raises UnknownToken if there is none with this id."""
        with self._changing() as tokens:
            if token_id not in tokens:
                raise UnknownToken(token_id, str(self.path))
            return tokens.pop(token_id)

    def _refresh(self) -> None:
        try:
            stat = self.path.stat()
        except FileNotFoundError:
            self._seen, self._tokens = None, {}
            return
        except OSError as error:
            self._seen, self._tokens = None, {}
            raise TokenFileError(str(self.path), error.strerror or str(error)) from error
        seen = (stat.st_ino, stat.st_mtime_ns, stat.st_size)
        if seen != self._seen:
            self._seen, self._tokens = None, {}
            self._tokens = self._read()
            self._seen = seen

    def _read(self) -> dict[str, Token]:
        try:
            document = _Document.model_validate_json(self.path.read_bytes())
        except OSError as error:
            raise TokenFileError(str(self.path), error.strerror or str(error)) from error
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            place = ".".join(str(part) for part in first["loc"])
            raise TokenFileError(str(self.path), f"{place}: {first['msg']}") from error
        return {token.id: token for token in document.tokens}

    @contextmanager
    def _changing(self) -> Iterator[dict[str, Token]]:
        """Hand out the tokens to be changed, one change at a time; the file is whole always."""
        directory = self.path.parent
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            lock = os.open(directory, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX)
                self._refresh()
                tokens = dict(self._tokens)
                yield tokens
                document = _Document(tokens=tuple(tokens.values()))
                self._write(document.model_dump_json(indent=1).encode())
                self._refresh()
            finally:
                os.close(lock)
        except OSError as error:
            raise TokenFileError(str(self.path), error.strerror or str(error)) from error

    def _write(self, data: bytes) -> None:
        # for its owner's eyes only from the start: that is what mkstemp makes
        handle, name = tempfile.mkstemp(dir=self.path.parent, prefix=self.path.name)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            Path(name).replace(self.path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def utc_now() -> datetime:
    """Return the time, as `TokenFile` takes it."""
    return datetime.now(UTC)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
