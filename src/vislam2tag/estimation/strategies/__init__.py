"""Mapping strategies: one file each."""
