"""Arguments and options that several verbs share."""

from pathlib import Path
from typing import Annotated

import typer

RecordingArgument = Annotated[Path, typer.Argument(metavar="RECORDING", help="A recording's file.")]
HostOption = Annotated[str | None, typer.Option(help="Address to listen on.  [default: 127.0.0.1]")]
PortOption = Annotated[
    int | None, typer.Option(help="TCP port; 0 takes any free one.  [default: 8000]")
]
ConfigOption = Annotated[
    Path | None, typer.Option(help="Settings in TOML.  [default: ./transientcam.toml]")
]
DeviceOption = Annotated[
    str,
    typer.Option(
        help="What computes the pass over a frame: cpu; gpu, or gpu:NAME, as `transientcam doctor` "
        "names them; auto, where a GPU is worth it."
    ),
]
