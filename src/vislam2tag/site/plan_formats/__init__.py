"""Formats of floor plans: one file each."""
