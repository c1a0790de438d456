"""The command line: one module per command, in packages as ``--help`` groups them; each calls a function of ours."""

from vislam2tag.cli.app import main

__all__ = ["main"]
