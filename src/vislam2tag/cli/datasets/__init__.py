"""Commands for data sets: build, split, import, export, join, compare, draw."""
