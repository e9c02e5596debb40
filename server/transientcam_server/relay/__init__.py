"""The camera of another service, subscribed to once and served again (docs/relay.md).

`RelayCamera` is the camera, `Origin` the other service as its REST interface describes it, and
`plugin` what opens ``relay:http://HOST:PORT``.
"""

from transientcam_server.relay._camera import RelayCamera
from transientcam_server.relay._origin import Described, Origin
from transientcam_server.relay._plugin import PLUGIN, uses_token
