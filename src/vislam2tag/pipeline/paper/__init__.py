"""The paper's tables and figures from its data.

``data`` finds its surveys; ``walks`` evaluates (Tables I and II), ``collection`` labels and counts (Table III),
``positioning`` trains (Table IV), ``figures`` draws; ``reproduce`` takes all these steps.
"""
