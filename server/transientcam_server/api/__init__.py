"""The HTTP and WebSocket interface: `app.build_app` makes it of a service.

`routes` has one file a resource and `documents` its JSON documents under the same names; `auth`,
`middleware`, `stream` and `docs` are what the names say. `frame_query` and `frame_routes` serve the
frames of the camera and of recordings alike, `problems` every answer.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
