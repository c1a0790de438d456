"""Many surveys under one prefix, a folder of this machine or one in a store.

``catalogue`` says what lies where and has a row for each survey, ``add`` makes rows (``raw_copy`` copies the files),
``process`` maps what the catalogue lists; ``reduction`` makes of a survey's sessions its summary, tables and pages, and
the pages about the fleet.
"""
