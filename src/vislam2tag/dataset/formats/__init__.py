"""Formats of the field: a module each, or a package with modules for reading and writing, that registers it."""
