"""Verbs of the command line: functions, or groups of them, that packages offer as entry points.

Only the verb that is run is imported, so that the client's verbs start fast and work also where the
server's packages are not installed.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

import typer

from transientcam.cli.terminal import escape
from transientcam.errors import CommandUnavailable

GROUP: Final = "transientcam.commands"
_EXTRA_OF_PACKAGE: Final = {
    "foxglove": "foxglove",
    "matplotlib": "plot",
    "rerun": "rerun",
    "transientcam_driver": "driver",
    "transientcam_simulation": "driver",
    "transientcam_conformance": "conformance",
    "transientcam_moments": "server",
    "transientcam_server": "server",
}


def load_verbs(app: typer.Typer, arguments: Sequence[str]) -> None:
    """Add the verb that ``arguments`` name to ``app``, or all of them where they name none.

    The version is printed without any.
    """
    if "--version" in arguments[:1]:
        return
    points = {point.name: point for point in entry_points(group=GROUP)}
    named = next((each for each in arguments if not each.startswith("-")), None)
    chosen = [points[named]] if named in points else [points[name] for name in sorted(points)]
    for point in chosen:
        _add(app, point)


def words_to_complete(environment: Mapping[str, str]) -> list[str]:
    """Return the words so far, where a shell requests completions; else nothing.

    bash passes them in one variable, zsh and fish in another one.
    """
    if "_TRANSIENTCAM_COMPLETE" not in environment:
        return []
    words = environment.get("_TYPER_COMPLETE_ARGS") or environment.get("COMP_WORDS") or ""
    return words.split()[1:]


def extra_of(module: str, verb: str) -> str | None:
    """Return the extra that installs a missing ``module`` of a verb; None if it is not known."""
    packages = [module.partition(".")[0]]
    packages += [point.module.partition(".")[0] for point in entry_points(group=GROUP, name=verb)]
    return next(filter(None, map(_EXTRA_OF_PACKAGE.get, packages)), None)


def _add(app: typer.Typer, point: EntryPoint) -> None:
    try:
        function: Callable[..., Any] | typer.Typer = point.load()
    except ModuleNotFoundError as error:
        missing = CommandUnavailable(
            point.name, error.name or "", extra_of(error.name or "", point.name)
        )
        remedy = f"pip install 'transientcam[{missing.extra}]'" if missing.extra else str(missing)
        app.command(
            point.name,
            help=escape(f"(not installed: {remedy})"),
            context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
            add_help_option=False,
        )(_unavailable(missing))
    else:
        if isinstance(function, typer.Typer):
            app.add_typer(function, name=point.name)
        else:
            app.command(point.name)(function)


def _unavailable(missing: CommandUnavailable) -> Callable[[typer.Context], None]:
    def refuse(context: typer.Context) -> None:
        raise missing

    return refuse
