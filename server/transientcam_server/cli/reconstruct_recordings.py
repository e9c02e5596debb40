"""What the verb ``reconstruct`` does with recordings: here, or on a cluster."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from transientcam.cli.terminal import Terminal, echo, progress_bar
from transientcam.text import plain
from transientcam_server.cli.cluster import cluster_client
from transientcam_server.errors import MissingExtra, MixedVersions

if TYPE_CHECKING:
    from transientcam_server.offline import BatchOptions
    from transientcam_server.recording import Header
    from transientcam_server.settings import ReconstructionSettings


@dataclass(frozen=True, slots=True)
class ReconstructionChoices:
    """Names of products, if any were given; settings in place of the recorded ones."""

    products: Sequence[str]
    changes: Mapping[str, float | str]
    bins: int

    def options(self, header: "Header") -> "BatchOptions":
        """Return what to compute of a recording with this header."""
        from transientcam_server.offline import BatchOptions, default_products, known_products

        there = [name for name in known_products() if name != "raw"]
        for name in self.products:
            if name not in there:
                known = ", ".join(there)
                raise typer.BadParameter(f"{name!r} is none of {known}", param_hint="--product")
        names = tuple(dict.fromkeys(self.products or default_products(header.applied)))
        settings = settings_of({**header.reconstruction, **self.changes})
        return BatchOptions(names, settings, self.bins)


def settings_of(values: Mapping[str, Any]) -> "ReconstructionSettings":
    """Return settings with these values, or refuse the one that cannot be used."""
    from pydantic import ValidationError

    from transientcam_server.settings import ReconstructionSettings

    try:
        return ReconstructionSettings.recorded(values)
    except ValidationError as error:
        mistake = error.errors()[0]
        raise typer.BadParameter(f"{mistake['loc'][0]}: {mistake['msg']}") from error


def reconstruct_recording(
    place: str, output: Path, wanted: ReconstructionChoices, token: str | None, *, as_json: bool
) -> None:
    """Reconstruct every frame of a recording, continuing an interrupted run.

    Kernels are compiled first, as on a cluster, so that each run gives the same bits.
    """
    from transientcam_server import offline
    from transientcam_server.offline import BatchReconstructor, load_kernels, recording_at

    with recording_at(place, token=token) as opened:
        options = wanted.options(opened.header)
        load_kernels(BatchReconstructor(opened, options).recipe)
        with progress_bar("reconstructing") as advance:
            before = offline.reconstruct_recording(opened, output, options, progress=advance)
        _report(str(output), options.products, opened.frames, before, as_json=as_json)


def reconstruct_on_cluster(
    place: str,
    output: str,
    wanted: ReconstructionChoices,
    workers: int | None,
    dask: str | None,
    token: str | None,
    *,
    as_json: bool,
) -> None:
    """Reconstruct one recording, or all of a directory, on a cluster.

    Of a directory those that cannot be are named, and the others reconstructed.
    """
    console = Terminal(stderr=True)
    outputs, failed = _outputs(place, output), 0
    with cluster_client(workers, dask, console) as client:
        from transientcam_server.offline import reconstruct_on, recording_at

        for each, into in outputs.items():
            try:
                with recording_at(each, token=token) as opened:
                    options = wanted.options(opened.header)
                with progress_bar("reconstructing") as advance:
                    frames, before = reconstruct_on(
                        client, each, into, options, token=token, progress=advance
                    )
            except (MissingExtra, MixedVersions):
                raise
            except Exception as error:  # of a file that anybody may have written
                if len(outputs) == 1:
                    raise
                console.print(plain(f"{each}: {error}"))
                failed += 1
            else:
                _report(into, options.products, frames, before, as_json=as_json)
    if failed:
        console.print(f"{failed} of {len(outputs)} recordings are not reconstructed")
        raise typer.Exit(code=1)


def _outputs(place: str, output: str) -> dict[str, str]:
    """Return where the products of each recording go."""
    if "://" in place or not Path(place).is_dir():
        # workers may run in another directory
        place = place if "://" in place else str(Path(place).resolve())
        if not output.endswith(".zarr"):
            raise typer.BadParameter(
                f"{output} must end in .zarr, which a cluster writes", param_hint="--output"
            )
        return {place: _absolute(output)}
    files = sorted(each for each in Path(place).resolve().glob("*.h5") if each.is_file())
    if not files:
        raise typer.BadParameter(f"{place} has no recording (.h5)", param_hint="INPUT")
    return {str(file): f"{_absolute(output)}/{file.stem}.zarr" for file in files}


def _absolute(output: str) -> str:
    return output.rstrip("/") if "://" in output else str(Path(output).resolve())


def _report(
    output: str, products: Sequence[str], frames: int, before: int, *, as_json: bool
) -> None:
    if as_json:
        document = {"file": output, "products": products, "frames": frames, "before": before}
        echo(json.dumps(document))
        return
    resumed = f", {before} of them before" if before else ""
    Terminal(stderr=True).print(f"{output}: {', '.join(products)} of {frames} frames{resumed}")
