"""The verbs of the command line as they declare themselves, and one run of one of them."""

import io
import os
import re
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final, Literal, get_args

import typer

from transientcam.cli import app_for, run
from transientcam.text import plain

SECRET: Final = "tcam_5up3r-53cr3t-of-this-matrix"
CLOSED: Final = "http://127.0.0.1:1"
USUAL: Final[Mapping[str, Sequence[str]]] = {
    "calibrate": [CLOSED],
    "compile": ["--harmonics", "0"],
    "demo": ["there-is-no-such-scene"],
    "devices": ["--no-network"],
    "emulate": ["there-is-no-such-scene"],
    "explain": ["wall"],
    "paper": ["99", "-o", "paper"],
    "plan": ["--daemon", CLOSED],
    "serve": ["--check"],
    "token create": ["bench"],
    "token revoke": ["0123abcd"],
    "tradeoff": ["-o", "tradeoff", "--sequence-grid", "there-is-no-such-grid.toml"],
}
"""What a verb is given that would work for long, or for ever, with what it requires alone."""
_TAKEN: Final = {"url": CLOSED, "output": "made.npz", "product": "range"}
"""What stands for a required parameter of this name; a file that is not there for any other."""


@dataclass(frozen=True)
class Verb:
    """A verb, by the words that name it, and what takes a text or a number of the user's."""

    name: str
    usual: tuple[str, ...]
    texts: tuple[str, ...]
    numbers: tuple[str, ...]
    arguments: int

    @property
    def words(self) -> list[str]:
        return self.name.split()

    def given(self, text: str, *, number: bool = False) -> Iterator[tuple[str, list[str]]]:
        """Return where the text is given, and all words, for each place that takes one."""
        for option in self.numbers if number else self.texts:
            yield option, [*self.words, *self.usual, f"{option}={text}"]
        for at in range(0 if number else self.arguments):
            usual = list(self.usual)
            usual[at : at + 1] = [text]
            yield f"argument {at + 1}", [*self.words, *usual]


def verbs() -> list[Verb]:
    """Return every verb of the command line, groups taken apart."""
    root: Any = typer.main.get_command(app_for([]))
    return [_verb(name, command) for name, command in _leaves("", root)]


def _leaves(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    if not hasattr(command, "commands"):
        yield name, command
        return
    for word, below in command.commands.items():
        yield from _leaves(f"{name} {word}".strip(), below)


def _verb(name: str, command: Any) -> Verb:
    texts = [each for each in command.params if _kind(each) in (str, Path)]
    numbers = [each for each in command.params if _kind(each) in (int, float)]
    required = [each for each in command.params if each.required]
    usual: list[str] = []
    for each in required:
        filler = _TAKEN.get(each.name, "there-is-no-such-file.h5")
        usual += (
            [filler] if each.param_type_name == "argument" else [max(each.opts, key=len), filler]
        )
    chosen = USUAL.get(name, usual)
    positions = sum(each.param_type_name == "argument" for each in texts)
    first = next((k for k, word in enumerate(chosen) if word.startswith("-")), len(chosen))
    return Verb(name, tuple(chosen), _options(texts), _options(numbers), min(positions, first))


def _kind(parameter: Any) -> object:
    """Return what a parameter, or each item of it, is read as."""
    annotation = parameter.type_descriptor.annotation
    return next(iter(get_args(annotation)), annotation)


def _options(params: list[Any]) -> tuple[str, ...]:
    return tuple(max(p.opts, key=len) for p in params if p.param_type_name == "option")


@dataclass(frozen=True)
class Ran:
    """How a run ended, and what it printed."""

    words: Sequence[str]
    code: int
    out: str
    err: str
    broken: str = ""

    def problem(self, text: str = "") -> str | None:
        """Return what is wrong with it; a text that was given must be shown as it is."""
        said = f"{self.out}\n{self.err}"
        if self.broken:
            return self.broken
        for never in ("Traceback (most recent", "mistake in transientcam", SECRET):
            if never in said:
                return f"prints {never!r}: {said[-600:]}"
        if self.code not in (0, 1, 2):
            return f"ends with {self.code}"
        if self.code and not said.strip():
            return "gives no reason"
        return _mangled(text, said)


_WORD: Final = re.compile(r"Gr[^ ]{1,6}e")


def _mangled(text: str, said: str) -> str | None:
    """Say whether a text is shown otherwise than it is; ``Größe`` stands in each."""
    if "Größe" not in text or not _WORD.search(said) or "…" in said:
        return None
    seen = re.sub(r"[\s│]+", "", said)
    forms = (text, plain(text), plain(text, lines=True), repr(text)[1:-1], text.replace('"', '\\"'))
    if any(re.sub(r"\s+", "", each) in seen for each in forms):
        return None
    return f"shows {text!r} as {said[-400:]!r}"


class _Terminal(io.TextIOWrapper):
    def isatty(self) -> bool:
        return True


def ran(
    words: Sequence[str],
    *,
    encoding: str = "utf-8",
    terminal: bool = False,
    instead: IO[str] | Literal["captured"] | None = "captured",
) -> Ran:
    """Run a command line in this process, with something ``instead`` of standard output."""
    kind = _Terminal if terminal else io.TextIOWrapper
    out, err = (kind(io.BytesIO(), encoding, "backslashreplace") for _ in range(2))
    code, broken = -1, ""
    with redirect_stdout(out if instead == "captured" else instead), redirect_stderr(err):
        try:
            code = run(list(words))
        except BaseException as error:
            broken = "".join(traceback.format_exception(error))[-1500:]
    texts = []
    for stream in (out, err):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode(encoding, "replace"))  # type: ignore[attr-defined]
    return Ran(words, code, texts[0], texts[1], broken)


@contextmanager
def standing_in(folder: Path) -> Iterator[None]:
    """Work in a folder, and come back from it."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
