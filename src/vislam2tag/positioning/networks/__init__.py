"""Neural networks of the paper; needs the extra ``models``.

``layers`` are what ``regression`` and ``multi_cel`` (over ``overlapping_cells``) are made of; ``training`` trains
them, ``locator`` is one with all that it takes to answer, ``positioner`` makes a positioning model of it.
"""
