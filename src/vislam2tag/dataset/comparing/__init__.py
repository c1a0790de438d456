"""Two data sets: are they the same, what changed between them, and joining them."""
