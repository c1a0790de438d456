"""What of a walkable space was walked, and the walk that fills the rest.

``walking_distances`` measures ways over a space. Doors part it into rooms and corridors (``areas``); ``walked_space``
tells which of them walks came near, and makes the ``short_walk`` past the rest: ``walked_record``.
"""
