"""The kinds of fault that the walks' geometry tells, one module each; ``quality/diagnosis/search.py`` lists them."""
