"""Many surveys in one folder, on this machine or in a store.

``catalogue`` describes the layout and has a row for each survey. ``add`` adds rows (``raw_copy`` copies the files), and
``process`` processes the surveys in the catalogue. ``reduction`` writes the summary, tables and pages of a survey, and
the pages about the fleet.
"""
