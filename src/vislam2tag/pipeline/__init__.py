"""What a command does, from a folder to a folder; ``run`` is what all long jobs need.

A survey begins in ``site``; ``labels`` makes tables of its sessions, ``datasets`` data sets of these, ``positioning``
models of data sets. ``paper`` and ``demo`` take all steps.
"""
