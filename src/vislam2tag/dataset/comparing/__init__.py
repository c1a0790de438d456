"""Two data sets: are they the same (comparable, table by table), what changed in between, and joining them."""
