"""Run ``python -m benchmarks.likelihood [--data FOLDER] [--only PART] [--write]``."""
