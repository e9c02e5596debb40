from ._app import build_app as build_app
from ._auth import TokenFile as TokenFile
from ._auth.tokens import Role as Role, utc_now as utc_now
from ._middleware.security import SECURITY_HEADERS as SECURITY_HEADERS, own_names as own_names
from ._problems import problem_response as problem_response
