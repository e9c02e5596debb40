"""What accuracy costs on every scene, how well it is predicted, and whether plans keep it."""
