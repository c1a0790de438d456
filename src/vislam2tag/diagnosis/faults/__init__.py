"""The kinds of fault that the walks' geometry tells, one module each; ``diagnosis/search.py`` lists them."""
