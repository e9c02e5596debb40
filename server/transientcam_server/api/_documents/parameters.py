"""The JSON documents of what can be set, and of what limits there are."""

from typing import Any, Literal

from transientcam_server.api._documents.document import Document

Access = Literal["read-write", "read-only"]


class ParameterDocument(Document):
    """One value, and what it may be while the others stay as they are."""

    name: str
    resource: str
    """Whose document it stands in: `PUT` that, changed, to set it."""
    pointer: str
    """Where in that document: a JSON pointer (RFC 6901)."""
    value: Any = None
    type: Literal["number", "integer", "boolean", "string"]
    unit: str | None = None
    min: int | float | None = None
    """The least that is accepted; null without such a limit."""
    max: int | float | None = None
    """The most that is accepted; null without such a limit."""
    allowed: list[Any] | None = None
    """Every value that is accepted; null where they are not counted."""
    access: Access
    """What is `read-only` is set when the service starts, or not at all."""
    description: str


class ParametersDocument(Document):
    """All parameters."""

    parameters: list[ParameterDocument]
