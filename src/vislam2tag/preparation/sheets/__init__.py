"""Printable landmarks: images that a tracker recognises, on sheets of true size.

``sheet_requests`` tells which landmarks get a sheet. ``images`` are generated (``dead_leaves``) or users' own; each is
measured (``quality``: ``features``, ``recognition`` in simulated ``views``). ``page_layout`` and ``page`` put them on
paper, ``sheet_folder`` writes PDF, images and manifest; ``making`` takes all these steps.
"""
