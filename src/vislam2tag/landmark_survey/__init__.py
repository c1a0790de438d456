"""Landmarks that nobody surveyed, from all walks together: local map of a walk -> charts -> joint landmark map."""
