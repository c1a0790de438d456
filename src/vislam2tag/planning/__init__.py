"""Where landmarks should stand, from the smoother's own model."""
