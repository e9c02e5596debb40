"""The verbs that this package adds to the ``transientcam`` command, one file each.

Their modules are loaded for ``transientcam --help``; each verb imports what is heavy when it runs.
"""
