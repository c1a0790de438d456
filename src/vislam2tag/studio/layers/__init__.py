"""Layers of the studio's map: one file for those that tell of one thing."""
