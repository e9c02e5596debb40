"""What all JSON documents of the REST interface have in common."""

from pydantic import BaseModel, ConfigDict


class Document(BaseModel):
    """A JSON document whose fields are described beside them."""

    model_config = ConfigDict(use_attribute_docstrings=True)
