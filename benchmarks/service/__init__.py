"""The daemon as clients have it: its stream, its relays, its start, and what it survives."""
