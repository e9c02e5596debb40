from ._check import (
    mistakes_document as mistakes_document,
    require_usable as require_usable,
    to_document as to_document,
    to_toml as to_toml,
)
from ._configuration import (
    load as load,
    load_settings as load_settings,
    tokens_file_of as tokens_file_of,
)
from ._server import (
    address as address,
    configure_logging as configure_logging,
    exit_without_joining as exit_without_joining,
    freeze_startup_objects as freeze_startup_objects,
    listen as listen,
    serve_app as serve_app,
)
