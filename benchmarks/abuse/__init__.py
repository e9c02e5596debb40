"""Whether clients can take the service away from others."""
