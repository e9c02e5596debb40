"""What measurements share: their records and pages, the machine, a daemon, scenes and images."""
