"""Formats of the field: one file each, found by import, that registers how it is read, written, or both."""
