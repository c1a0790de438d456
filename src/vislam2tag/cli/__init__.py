"""The command line: each command calls a function of the pipeline and prints what it returns.

``app`` finds the command in one of the modules ``commands_NAME``; ``records`` makes options of records and parameters,
``options`` has those that several commands share and makes those that are settings. ``terminal``, ``tables``,
``progress`` and ``next_steps`` print for all commands; ``addresses`` puts folders of this machine in the place of
addresses in object storage.
"""

from vislam2tag.cli.app import main

__all__ = ["main"]
