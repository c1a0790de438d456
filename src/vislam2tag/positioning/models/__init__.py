"""Positioning models: one file and one registered name for each."""
