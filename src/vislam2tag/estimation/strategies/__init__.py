"""Mapping strategies: one file for each, and one for both variants of a mapping of the paper."""
