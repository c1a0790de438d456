"""Many surveys under one prefix, a folder of this machine or one in a store.

``layout`` says what lies where, ``catalogue`` holds a row for each survey, ``add`` makes rows, ``process`` maps what
the catalogue lists; ``reduction`` makes of a survey's sessions its summary, tables (``tables``) and pages; ``report``
makes the pages about the fleet.
"""
