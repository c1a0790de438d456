"""Where a floor can be walked: from plan to mask, walls and a graph of corridors.

An image of a plan loses what is no wall (``ink``, ``lettering``, ``strokes``, ``door_swings``), and ``image_cells``
makes cells of it; ``plan_cells`` makes them of polygons and lines. With a drawn ``correction``, ``regions`` keeps the
one region that is walked: ``space``. Its ``skeleton`` (by ``tracing``) is a ``network`` of lines, on which ``rooms``
finds doors and rooms, ``open_areas`` puts nets over halls and ``tidying`` merges and straightens: ``graph``.
``walked`` tells which rooms and corridors walks came near, and makes the walk past the rest.
"""
