"""The HTTP and WebSocket interface: `app.build_app` makes it of a service.

`routes` has one file a resource and `documents` its JSON documents under the same names; `auth`,
`middleware`, `stream` and `docs` are what the names say. `frame_query` and `frame_routes` serve the
frames of the camera and of recordings alike, `problems` every answer.
"""

from transientcam_server.api._app import build_app
from transientcam_server.api._auth import TokenFile
from transientcam_server.api._auth.tokens import Role, utc_now
from transientcam_server.api._middleware.security import SECURITY_HEADERS, own_names
from transientcam_server.api._problems import problem_response

__all__ = [
    "SECURITY_HEADERS",
    "Role",
    "TokenFile",
    "build_app",
    "own_names",
    "problem_response",
    "utc_now",
]
