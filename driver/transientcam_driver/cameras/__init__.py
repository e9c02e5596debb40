"""The cameras there are drivers for, one package each."""
