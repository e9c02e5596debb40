"""Arguments and options that several verbs share."""

from pathlib import Path
from typing import Annotated

import typer

RecordingArgument = Annotated[Path, typer.Argument(metavar="RECORDING", help="A recording's file.")]
