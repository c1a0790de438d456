"""The paper's tables and figures from its data.

``data`` finds its surveys; ``walks`` evaluates (Tables I and II), ``collection`` labels and counts (Table III),
``figures`` draws; ``reproduce`` takes all these steps, and trains (Table IV).
"""
