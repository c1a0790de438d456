"""Neural networks of the paper; needs the extra ``models``.

``layers`` are what ``regression`` and ``multi_cel`` are made of, up to a network with all that it takes to answer;
``positioner`` trains one and makes a positioning model of it.
"""
