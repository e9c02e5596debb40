"""The camera on the network: a daemon that captures, reconstructs and serves.

Its rooms, from the top: ``cli``, ``daemon`` (the process), ``api`` (HTTP and the stream),
``service`` (the composition), ``camera`` and ``offline``, ``recording``, ``planning`` and
``broadcast``, ``imaging``, and ``errors``, ``settings`` and ``logs`` below all. Each imports only
those below it.
"""
