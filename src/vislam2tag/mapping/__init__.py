"""Mapping strategies: one file and one registered name each."""
