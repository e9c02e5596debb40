"""Arguments and options that several verbs share."""

from typing import Annotated

import typer

UrlArgument = Annotated[
    str, typer.Argument(metavar="URL", help="The daemon, such as http://127.0.0.1:8000.")
]
TokenOption = Annotated[
    str | None,
    typer.Option(envvar="TRANSIENTCAM_TOKEN", help="Proves who asks, where the daemon wants that."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
