"""The routes, one file a resource; each has a ``router`` that `api.app` includes."""
