"""What accuracy costs on every scene, how well it is predicted, and docs/accuracy.md of both."""
