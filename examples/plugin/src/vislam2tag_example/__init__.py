"""An example of a package that adds to vislam2tag: a mapping strategy and a format to export."""
