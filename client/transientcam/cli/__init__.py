"""The ``transientcam`` command.

Exit codes: 0 done, 1 failed (with one sentence on standard error), 2 wrong usage,
130 interrupted.
"""

import io
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated, Any, Final

import typer

from transientcam.cli.terminal import echo
from transientcam.cli.verbs import extra_of, load_verbs, words_to_complete
from transientcam.errors import CommandUnavailable, TransientcamError
from transientcam.text import plain

FAILED: Final = 1
INTERRUPTED: Final = 130
_EPILOG = "Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted."


def main() -> None:
    """Run the command line of this process."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # what its encoding lacks is escaped
            stream.reconfigure(errors="backslashreplace")
    code = run(sys.argv[1:])
    output: Any = sys.stdout or io.StringIO()  # without a console there is none
    try:
        output.flush()
    except OSError as error:  # the disk is full, or nobody reads any more
        os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())
        if not isinstance(error, BrokenPipeError):
            echo(f"transientcam: {error.strerror}", err=True)
        code = code or FAILED
    sys.exit(code)


def app_for(arguments: Sequence[str]) -> typer.Typer:
    """Return the command with the verb that ``arguments`` name, or all of them."""
    app = typer.Typer(
        name="transientcam",
        no_args_is_help=True,
        epilog=_EPILOG,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_top)
    load_verbs(app, arguments)
    return app


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    if os.environ.get("COLUMNS") == "0":  # as programs that know none set it: nothing would fit
        del os.environ["COLUMNS"]
    app = app_for(arguments or words_to_complete(os.environ))
    try:
        code = typer.main.get_command(app)(
            args=list(arguments), prog_name="transientcam", standalone_mode=False
        )
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return FAILED
    except Exception as error:
        if hasattr(error, "format_message"):
            return _wrong_usage(error)
        sentence = _sentence(error, arguments)
        if sentence is None:
            raise
        echo(f"transientcam: {sentence}", err=True)
        return FAILED
    return code if isinstance(code, int) else 0


def _wrong_usage(error: Any) -> int:
    """Print an error of typer's in its own frame, but for what a terminal would obey."""
    from typer.rich_utils import rich_format_error

    said = plain(error.format_message(), lines=True)
    error.format_message = lambda: said
    rich_format_error(error)
    return int(error.exit_code)


def _print_version(given: bool) -> None:
    if given:
        echo(f"transientcam {version('transientcam')}")
        raise typer.Exit


def _top(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Drive, watch and evaluate a camera that sees light move."""


def _sentence(error: Exception, arguments: Sequence[str]) -> str | None:
    """Return the sentence for an expected error, or None for a bug."""
    if isinstance(error, ModuleNotFoundError):
        module = error.name or ""
        if module.startswith("transientcam"):
            return None
        verb = next((each for each in arguments if not each.startswith("-")), "")
        return str(CommandUnavailable(verb, module, extra_of(module, verb)))
    if isinstance(error, OSError):
        place = f": {error.filename}" if error.filename is not None else ""
        return f"{error.strerror or error}{place}"
    # the errors of each package of this distribution are sentences for users
    ours = (each.__module__.partition(".")[0] for each in type(error).__mro__)
    if not any(root.startswith("transientcam") for root in ours):
        return None
    # what a service says stays in one line, in which it cannot pass for another message
    return " ".join(str(error).splitlines()) if isinstance(error, TransientcamError) else str(error)
