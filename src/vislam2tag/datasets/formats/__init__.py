"""Formats of the field: a module each, which reads, writes, or both, and registers itself."""
