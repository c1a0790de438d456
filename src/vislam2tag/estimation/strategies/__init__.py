"""Mapping strategies: one file each, and one for both variants of a mapping of the paper."""
