"""Landmarks that nobody surveyed, from all walks together (docs/explanation/landmarks.md).

Each walk is reduced to a ``local_map`` in its own frame; ``charts`` put the local maps together roughly, one by one;
``landmark_map`` adjusts them and the survey at once.
"""
