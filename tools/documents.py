"""What is written of what the programs state: types for the dashboard, pages of docs/.

The models of `transientcam_server.api._documents`, and for a frame `transientcam.documents`, state
each document once. OpenAPI and AsyncAPI documents follow from them, and of these the types of the
dashboard: run ``python tools/documents.py --write``. Without ``--write`` it says which file is not
as it would be written, and fails where one is. The types of the dashboard are always written: only
its compiler's check reads them, and the repository does not keep them.

No published generator serves: openapi-typescript needs the compiler of TypeScript 5, and
json-schema-to-typescript states a document anew wherever a field that refers to it is described.
"""

import argparse
import json
import sys
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from textwrap import indent
from typing import Any

import reference  # type: ignore[import-not-found]  # beside this script, no package
from light_table import with_table  # type: ignore[import-not-found]  # beside this script, no package

from transientcam_driver import open_camera
from transientcam_server.api._app import API, build_app
from transientcam_server.api._docs.asyncapi import asyncapi
from transientcam_server.settings import Settings

_ROOT = Path(__file__).parents[1]
TYPESCRIPT = _ROOT / "client/dashboard/src/stream/documents.d.ts"
"""Which git ignores."""
OPERATIONS = _ROOT / "docs/operations.md"
_Schema = Mapping[str, Any]


def files() -> dict[Path, str]:
    """Return each file as it should be."""
    with open_camera("sim:mirrors") as camera:
        openapi = build_app(camera, Settings()).openapi()
    streamed = asyncapi(version="", host="", secure=False)["components"]["schemas"]
    operations = dict(_operations(openapi["paths"]))
    answers = _table(
        "What the service answers, by the request.",
        {name: _answer(each) for name, each in operations.items()},
    )
    bodies = _table(
        "What a request sends, where that has a name.",
        {name: each.get("requestBody", {}) for name, each in operations.items()},
    )
    schemas: dict[str, _Schema] = openapi["components"]["schemas"]
    complete = _reached(answers, schemas) | {"FrameMeta", "Answers", "Bodies"}
    schemas["FrameMeta"] = _beside(streamed["meta"], schemas["FrameDocument"])
    stated = {"Answers": answers, "Bodies": bodies, **schemas}
    typescript = "\n".join(
        (
            "/** The documents; `python tools/documents.py` writes this file. */\n",
            *(_interface(name, each, name in complete) for name, each in sorted(stated.items())),
            f"export type Notice = {_typescript(streamed['notice'])};",
        )
    )
    return {
        TYPESCRIPT: typescript + "\n",
        OPERATIONS: with_table(OPERATIONS.read_text(encoding="utf-8")),
        **reference.pages(),
    }


def _operations(paths: _Schema) -> Iterator[tuple[str, _Schema]]:
    """Yield each operation of the interface by its method and path."""
    for path, methods in paths.items():
        for method, operation in methods.items():
            yield f"{method.upper()} {path.removeprefix(API)}", operation


def _answer(operation: _Schema) -> Any:
    return next(each for code, each in operation["responses"].items() if code < "300")


def _table(what: str, messages: Mapping[str, _Schema]) -> _Schema:
    """Return the documents of all requests, or of all answers, as if they were those of one."""
    found = {
        name: each.get("content", {}).get("application/json", {}).get("schema", {})
        for name, each in messages.items()
    }
    documents = {name: schema for name, schema in found.items() if "$ref" in schema}
    return {"description": what, "properties": documents}


def _beside(meta: _Schema, frame: _Schema) -> _Schema:
    """Return what the metadata of a streamed frame have beside those that REST answers."""
    properties = {k: v for k, v in meta["properties"].items() if k not in frame["properties"]}
    return {
        "description": "What is known of a frame, and which of its pixels an array holds.",
        "properties": properties,
        "extends": "FrameDocument",
    }


def _reached(found: object, schemas: Mapping[str, _Schema]) -> set[str]:
    """Return the names of all documents that something refers to, and those that these do."""
    reached: set[str] = set()
    waiting = list(_references(found))
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += _references(schemas[name])
    return reached


def _references(found: object) -> Iterator[str]:
    match found:
        case {"$ref": str(reference)}:
            yield _name(reference)
        case dict():
            for each in found.values():
                yield from _references(each)
        case list():
            for each in found:
                yield from _references(each)


# -- TypeScript --------------------------------------------------------------------------------


def _interface(name: str, schema: _Schema, complete: bool) -> str:
    """Return a document as an interface; one that is ``complete`` has all that it may have."""
    base = f"extends {schema['extends']} " if "extends" in schema else ""
    required = schema["properties"] if complete else schema.get("required", ())
    fields = _fields(schema, required)
    return f"{_comment(schema)}export interface {_identifier(name)} {base}{fields}\n"


def _fields(schema: _Schema, required: Container[str]) -> str:
    fields = (
        f'{_comment(each)}readonly "{name}"{"" if name in required else "?"}: {_typescript(each)};'
        for name, each in schema["properties"].items()
    )
    return "{\n" + indent("\n".join(fields), "  ") + "\n}"


def _comment(schema: _Schema) -> str:
    text = schema.get("description")
    return "" if text is None else "/** " + text.replace("\n", "\n * ") + " */\n"


def _typescript(schema: _Schema) -> str:
    match schema:
        case {"$ref": str(reference)}:
            return _identifier(_name(reference))
        case {"anyOf": either} | {"oneOf": either}:
            return " | ".join(map(_typescript, either))
        case {"enum": values}:
            return " | ".join(map(json.dumps, values))
        case {"const": value}:
            return json.dumps(value)
        case {"type": list(types)}:
            return " | ".join(_typescript({"type": each}) for each in types)
        case {"type": "array", "minItems": least, "maxItems": most} if least == most:
            return f"readonly [{', '.join([_typescript(schema['items'])] * least)}]"
        case {"type": "array"}:
            return f"readonly ({_typescript(schema.get('items', {}))})[]"
        case {"type": "object", "properties": _}:
            return _fields(schema, schema.get("required", ()))
        case {"type": "object", "additionalProperties": dict(inner)}:
            return f"Readonly<Record<string, {_typescript(inner)}>>"
        case {"type": "object"}:
            return "Readonly<Record<string, unknown>>"
        case {"type": "integer"}:
            return "number"
        case {"type": str(kind)}:
            return kind
    return "unknown"


def _identifier(name: str) -> str:
    return name.replace("-", "")  # of a document with one schema to send and one that is answered


def _name(reference: str) -> str:
    return reference.rpartition("/")[2]


def main() -> None:
    """Write the files, or say which differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write what differs")
    write = parser.parse_args().write
    differing = [(path, text) for path, text in files().items() if _written(path) != text]
    wrong = []
    for path, text in differing:
        if write or path == TYPESCRIPT:
            path.write_text(text, encoding="utf-8")
            print(f"{path.relative_to(_ROOT)} is written")
        else:
            wrong.append(path)
            print(f"{path.relative_to(_ROOT)} differs")
    sys.exit(bool(wrong))


def _written(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None


if __name__ == "__main__":
    main()
