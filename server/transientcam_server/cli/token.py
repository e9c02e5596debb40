"""The verbs ``token create``, ``token list`` and ``token revoke``."""

import json
import os
from datetime import timedelta
from pathlib import Path
from typing import Annotated, Literal

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo
from transientcam_server.cli.options import ConfigOption

app = typer.Typer(
    no_args_is_help=True, help="Create and revoke the tokens that give access to this camera."
)

_File = Annotated[
    Path | None,
    typer.Option("--tokens-file", help="File of the tokens, if not the configured one."),
]


@app.command()
def create(
    name: Annotated[str, typer.Argument(help="Who or what the token is for, such as bench-2.")],
    role: Annotated[
        Literal["viewer", "operator", "admin"],
        typer.Option(help="viewer reads, operator controls, admin also takes over any lease."),
    ] = "viewer",
    days: Annotated[
        float | None,
        typer.Option(min=0.0, max=36_500.0, help="How long it is valid.  [default: for ever]"),
    ] = None,
    may_light: Annotated[
        bool | None,
        typer.Option(
            help="Whether it may switch the light on; a viewer never may.  "
            "[default: operators and admins may]"
        ),
    ] = None,
    config: ConfigOption = None,
    tokens_file: _File = None,
    as_json: JsonOption = False,
) -> None:
    """Create a token and print it; it cannot be printed again."""
    from transientcam_server.api import Role, TokenFile, utc_now

    if not 1 <= len(name) <= 80 or not name.isprintable():
        raise typer.BadParameter("it must have 1 to 80 printable characters", param_hint="NAME")
    if role == "viewer" and may_light:
        raise typer.BadParameter("a viewer never has it", param_hint="--may-light")
    file = TokenFile(_path(config, tokens_file))
    now = utc_now()
    expires = None if days is None else now + timedelta(days=days)
    token, text = file.create(
        name, Role.named(role), now=now, expires=expires, may_light=may_light is not False
    )
    if as_json:
        echo(json.dumps({**_document(token.model_dump(mode="json")), "token": text}))
        return
    echo(text)
    Terminal(stderr=True).print(
        f"Token {token.id}, {role}, for {name}. It is shown only once; a running service accepts "
        "it at once.",
        highlight=False,
    )


@app.command("list")
def list_tokens(
    config: ConfigOption = None, tokens_file: _File = None, as_json: JsonOption = False
) -> None:
    """List the tokens: ids, names, roles and ends, not the secrets."""
    from transientcam_server.api import TokenFile, utc_now

    file = TokenFile(_path(config, tokens_file))
    tokens = file.tokens()
    if as_json:
        echo(json.dumps([_document(token.model_dump(mode="json")) for token in tokens]))
        return
    if not tokens:
        echo(f"There are no tokens in {file.path}.")
        return
    rows = []
    for token in tokens:
        expires = "never" if token.expires is None else f"{token.expires:%Y-%m-%d %H:%M}"
        if token.expired(utc_now()):
            expires += " (over)"
        made = f"{token.created:%Y-%m-%d}"
        light = "yes" if token.lights else "no"
        rows.append((token.id, token.name, token.role, light, made, expires))
    Terminal().table("id", "name", "role", "light", "made", "expires", rows=rows)


@app.command()
def revoke(
    token_id: Annotated[str, typer.Argument(metavar="ID", help="As `token list` shows it.")],
    config: ConfigOption = None,
    tokens_file: _File = None,
    as_json: JsonOption = False,
) -> None:
    """Make a token invalid; its open streams are closed."""
    from transientcam_server.api import TokenFile

    token = TokenFile(_path(config, tokens_file)).revoke(token_id)
    if as_json:
        echo(json.dumps(_document(token.model_dump(mode="json"))))
    else:
        echo(f"Token {token.id} of {token.name} is not valid any more.")


def _path(config: Path | None, tokens_file: Path | None) -> Path:
    from transientcam_server.daemon import tokens_file_of

    return tokens_file or tokens_file_of(config, environment=os.environ)


def _document(kept: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in kept.items() if key != "sha256"}
