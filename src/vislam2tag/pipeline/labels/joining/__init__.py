"""Walks of a survey joined by what they share: landmarks that nobody surveyed, odd references, walks together."""
