"""Arguments and options that several verbs share."""

from pathlib import Path
from typing import Annotated

import typer

RecordingArgument = Annotated[Path, typer.Argument(metavar="RECORDING", help="A recording's file.")]
DeviceOption = Annotated[
    str,
    typer.Option(
        help="What computes the pass over a frame: cpu; gpu, or gpu:NAME, as `transientcam doctor` "
        "names them; auto, where a GPU is worth it."
    ),
]
