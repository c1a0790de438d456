"""Where a floor can be walked: from plan to mask, walls and a graph of corridors.

An image of a plan loses what is no wall (``ink``, ``lettering``, ``strokes``, ``door_swings``), and ``image_cells``
makes cells of it; ``plan_cells`` makes them of polygons and lines. With a drawn ``correction``, ``regions`` keeps the
one region that is walked: ``space``. Its ``skeleton`` (by ``tracing``) is a ``network`` of lines, on which ``rooms``
finds doors and rooms, ``open_areas`` puts nets over halls and ``tidying`` merges and straightens: ``graph``.
``walking_distances`` measures ways over a space. Doors part it into rooms and corridors (``areas``);
``walked_space`` tells which of them walks came near, and makes the ``short_walk`` past the rest: ``walked_record``.
"""
