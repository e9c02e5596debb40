"""What every request passes: its log and its id, and checks of origin, size and headers."""
