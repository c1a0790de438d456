"""The command line: one module per command, each a thin layer over an importable function."""

from vislam2tag.cli.app import main

__all__ = ["main"]
