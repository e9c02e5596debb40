"""Arguments and options that several verbs share."""

from pathlib import Path
from typing import Annotated

import typer

from transientcam.wire import PRODUCTS

UrlArgument = Annotated[
    str, typer.Argument(metavar="URL", help="The daemon, such as http://127.0.0.1:8000.")
]
ProductArgument = Annotated[
    str,
    typer.Argument(
        help="What to capture: range, transient, raw, …", autocompletion=lambda: list(PRODUCTS)
    ),
]
ProductsArgument = Annotated[
    list[str] | None,
    typer.Argument(
        help="Products to stream; default: range.", autocompletion=lambda: list(PRODUCTS)
    ),
]
TokenOption = Annotated[
    str | None,
    typer.Option(envvar="TRANSIENTCAM_TOKEN", help="Bearer token, where the daemon requires one."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]


def require_suffix(path: Path | None, *suffixes: str, hint: str = "--output") -> None:
    """Refuse a file whose suffix names another format than the one that is written (usage)."""
    if path is not None and path.suffix.lower() not in suffixes:
        known = " or ".join(suffixes)
        raise typer.BadParameter(f"{path} must end in {known}, which is written", param_hint=hint)
