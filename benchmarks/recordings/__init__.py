"""Recordings: what they cost, what they survive, and ranges computed from their files."""
