"""Where a floor can be walked: from plan to mask, walls and a graph of corridors.

An image of a plan loses what is not a wall (``ink``, ``door_swings``). ``drawn_cells`` makes cells of polygons and
lines, and ``painted_cells`` applies corrections painted by hand. ``space`` keeps the one region that is walked. Its
``skeleton`` is a network of lines; ``graph`` finds doors, rooms and open areas on it. ``walked`` finds which rooms and
corridors walks came near, and makes the walk past the rest by ``walking_distances``.
"""
