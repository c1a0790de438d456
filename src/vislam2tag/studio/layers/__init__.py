"""Layers of the studio's map, with one file per topic."""
