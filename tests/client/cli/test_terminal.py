"""Nothing that a server says moves a terminal: what each way of printing writes."""

import io

import pytest
from rich.progress import Progress, TextColumn
from rich.table import Table
from rich.text import Text

from transientcam.cli import run
from transientcam.cli.terminal import Terminal, echo
from transientcam.errors import ProblemError

HOSTILE = "\x1b]0;title\x07\x1b]52;c;eA==\x07\x1b[2J\x9b1A\u202ed\x08[link=http://e]x[/link]"
SHOWN = "\\x1b]0;title"


def written(*renderables: object) -> str:
    file = io.StringIO()
    console = Terminal(file=file, force_terminal=True, width=300, highlight=False)
    console.print(*renderables)
    return file.getvalue()


def table() -> Table:
    made = Table(title=HOSTILE)
    made.add_column(HOSTILE)
    made.add_row(HOSTILE)
    return made


@pytest.mark.parametrize(
    "renderable", [HOSTILE, Text(HOSTILE), Text(HOSTILE, style="bold red"), table()]
)
def test_a_terminal_shows_what_it_would_have_obeyed(renderable: object) -> None:
    text = written(renderable)

    assert SHOWN in text
    assert "[link=http://e]" in text
    for obeyed in ("\x1b]", "\x07", "\x1b[2J", "\x9b", "\u202e", "\x08"):
        assert obeyed not in text


def test_its_own_colours_stay() -> None:
    assert written(Text("red", style="red")) == "\x1b[31mred\x1b[0m\n"


def test_a_bar_shows_its_description_plainly() -> None:
    file = io.StringIO()
    console = Terminal(file=file, force_terminal=True, width=300)
    columns = TextColumn("{task.description}", markup=False)
    with Progress(columns, console=console, auto_refresh=False) as progress:
        progress.add_task(HOSTILE)
    assert SHOWN in file.getvalue()
    assert "\x1b]" not in file.getvalue()


def test_a_line_is_plain(capsys: pytest.CaptureFixture[str]) -> None:
    echo(f"{HOSTILE}\nsecond\tline")
    out = capsys.readouterr().out
    assert out.startswith(SHOWN)
    assert out.endswith("\nsecond\tline\n")


def test_an_error_of_a_server_is_one_plain_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ProblemError(status=409, detail=f"{HOSTILE}\ntransientcam: all is well")

    monkeypatch.setattr("typer.main.get_command", lambda app: fail)
    assert run(["capture"]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "\x1b" not in err
    assert "\u202e" not in err
