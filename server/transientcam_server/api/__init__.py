"""The HTTP and WebSocket interface: `app.build_app` makes it of a service.

`routes` has one file a resource and `documents` its JSON documents under the same names; `auth`,
`middleware`, `stream` and `docs` are what the names say. `frame_query` and `frame_routes` serve the
frames of the camera and those of recordings alike; `problems` answers errors.
"""
