"""What all JSON documents of the REST interface have in common."""

import json
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BaseModel, BeforeValidator, ConfigDict, field_validator

from transientcam_server.settings import no_switch_for_a_number

EXAMPLES_FILE: Final = Path(__file__).with_name("examples.json")
"""What a simulated camera answered; ``python -m tools.examples --write`` writes it."""
EXAMPLES: Final[dict[str, Any]] = json.loads(EXAMPLES_FILE.read_text(encoding="utf-8"))
"""An example of each document that is answered, by the name of its model."""


def _whole(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


JsonInteger = Annotated[int, BeforeValidator(_whole)]
"""An integer of a strict document: JSON Schema calls 40.0 one (draft 2020-12, 4.2.3)."""


class Document(BaseModel):
    """A JSON document whose fields are described beside them.

    ``model_validate`` makes one of any value that has attributes of the same names.
    """

    model_config = ConfigDict(use_attribute_docstrings=True, from_attributes=True)


class RequestDocument(Document):
    """What a client asks for."""

    model_config = ConfigDict(extra="forbid")

    _numbers = field_validator("*", mode="before")(classmethod(no_switch_for_a_number))
