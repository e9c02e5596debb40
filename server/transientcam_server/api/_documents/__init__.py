"""The JSON documents of the REST interface, one file a resource, and their captured examples."""

from transientcam_server.api._documents.document import Document
