"""Who may do what: tokens and their roles, the guard of requests, permissions of routes."""

from transientcam_server.api._auth.tokens import Role, TokenFile
