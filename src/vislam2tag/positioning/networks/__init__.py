"""Neural networks of the paper; they need the extra ``models``.

``layers`` contains the parts of ``regression`` and ``multi_cel``; ``positioner`` trains a network and makes a
positioning model of it.
"""
