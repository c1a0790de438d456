"""Layers of the studio's map, one file each."""
