"""Whether clients can take the service away from others: ``python -m benchmarks.abuse``."""
