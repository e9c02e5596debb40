"""The reference pages: every verb of the command line, every setting of the daemon."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

from transientcam.cli import app_for
from transientcam_server.daemon._configuration import ENVIRONMENT_PREFIX
from transientcam_server.settings import Settings

DOCS = Path(__file__).parents[1] / "docs"
BEGIN = "<!-- `python tools/documents.py --write` writes what follows -->"
_DEFAULT_IN_HELP = re.compile(r"\s*\[default: (.*?)\]")
_OF_THIS_MACHINE = {
    "calibrations.directory": "calibrations in the state directory",
    "light.directory": "light in the state directory",
    "recordings.directory": "recordings in the state directory",
    "tokens_file": "tokens.json in the user's configuration",
    "workers": "one a processor",
}


def pages() -> dict[Path, str]:
    """Return each page as it should be."""
    return {
        path: _above(path) + "\n".join([BEGIN, *lines]) + "\n"
        for path, lines in (
            (DOCS / "command-line.md", list(_verbs())),
            (DOCS / "settings.md", list(_settings())),
        )
    }


def _above(path: Path) -> str:
    """Return what was written by hand, above what is generated."""
    return path.read_text(encoding="utf-8").partition(BEGIN)[0]


# -- verbs -------------------------------------------------------------------------------------


def verbs() -> dict[str, Any]:
    """Return every verb's command by its name; those of a group with the group's before."""
    commands: Mapping[str, Any] = typer.main.get_command(app_for([])).commands  # type: ignore[attr-defined]  # it is a group
    found: dict[str, Any] = {}
    for name in sorted(commands):
        below: Mapping[str, Any] | None = getattr(commands[name], "commands", None)
        if below is None:
            found[name] = commands[name]
        else:
            found |= {f"{name} {each}": below[each] for each in sorted(below)}
    return found


def _verbs() -> Iterator[str]:
    for name, command in verbs().items():
        words = [f"transientcam {name}", *map(_usage, command.params)]
        yield from ("", f"## {name}", "", "```", " ".join(filter(None, words)), "```", "")
        for paragraph in _paragraphs(command.help):
            yield from (_one_line(paragraph), "")
        yield from ("| | | default |", "|---|---|---|")
        yield from map(_row, command.params)


def _usage(parameter: Any) -> str:
    if parameter.param_type_name != "argument":
        return f"{parameter.opts[0]} …" if parameter.required else ""
    name = (parameter.metavar or parameter.name.upper()).strip("[]")
    name += "…" if parameter.nargs == -1 else ""
    return name if parameter.required else f"[{name}]"


def _row(parameter: Any) -> str:
    help_, default = _one_line(parameter.help or ""), ""
    stated = _DEFAULT_IN_HELP.search(help_)
    if stated:
        default, help_ = stated.group(1), _DEFAULT_IN_HELP.sub("", help_)
    elif parameter.required:
        default = "required"
    elif parameter.default not in (None, False, (), ""):
        default = f"`{_shown(parameter.default)}`"
    if parameter.param_type_name == "argument":
        name = (parameter.metavar or parameter.name.upper()).strip("[]")
    else:
        name = ", ".join([*parameter.opts, *parameter.secondary_opts])
    if isinstance(parameter.envvar, str):
        help_ += f" Or the variable `{parameter.envvar}`."
    return f"| `{name}` | {help_.replace('|', chr(92) + '|')} | {default} |"


def _shown(default: Any) -> str:
    if isinstance(default, list | tuple):
        return ", ".join(map(_shown, default))
    return str(getattr(default, "value", default))


def _paragraphs(text: str | None) -> list[str]:
    return (text or "").strip().split("\n\n")


def _one_line(text: str) -> str:
    return " ".join(text.split())


# -- settings ----------------------------------------------------------------------------------


def _settings() -> Iterator[str]:
    schema = Settings.model_json_schema()
    groups: dict[str, dict[str, Any]] = {"": {}}
    for name, described in schema["properties"].items():
        reference = described.get("$ref")
        if reference is None:
            groups[""][name] = described
        else:
            group = schema["$defs"][reference.rpartition("/")[2]]
            groups[name] = group
    yield from ("", "## Of all", "")
    yield from _settings_table("", groups.pop(""))
    for name, group in groups.items():
        yield from ("", f"## [{name}]", "", _one_line(group.get("description", "")), "")
        yield from _settings_table(f"{name}.", group["properties"])


def _settings_table(above: str, properties: Mapping[str, Any]) -> Iterator[str]:
    yield from ("| setting | what it is | values | default |", "|---|---|---|---|")
    for name, described in properties.items():
        help_ = _one_line(described.get("description", "")).replace("``", "`")
        default = _OF_THIS_MACHINE.get(above + name) or _json(described.get("default"))
        yield f"| `{above}{name}` | {help_} | {_values(described)} | {default} |"


def _values(described: Mapping[str, Any]) -> str:
    """Return type and limits."""
    for each in described.get("anyOf", ()):
        if each.get("type") != "null":
            described = {**each, **{key: described[key] for key in described if key != "anyOf"}}
    if "enum" in described:
        return ", ".join(f"`{each}`" for each in described["enum"])
    kind = str(described.get("format") or described.get("type", ""))
    kind = {"array": "list of text", "string": "text", "boolean": "true, false"}.get(kind, kind)
    limits = [
        f"{sign} {described[key]:g}"
        for key, sign in (
            ("minimum", "≥"),
            ("exclusiveMinimum", ">"),
            ("maximum", "≤"),
            ("exclusiveMaximum", "<"),
        )
        if key in described
    ]
    return ", ".join([kind, *limits])


def _json(value: object) -> str:
    match value:
        case None:
            return "none"
        case bool():
            return f"`{str(value).lower()}`"
        case _:
            return f"`{value}`"


def variable(setting: str) -> str:
    """Return the environment variable of a setting, as in ``stream.max_clients``."""
    return ENVIRONMENT_PREFIX + setting.replace(".", "__").upper()
