"""Preparation of a site, and changes of its frame.

``init`` starts a site, ``show`` draws it and its walkable space, ``plan`` plans landmarks, and ``register`` computes
their measured positions. ``rebase`` writes sites, labels and data sets in another layout or frame.
"""
