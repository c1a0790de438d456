"""Landmarks without a survey, placed from all walks together (docs/explanation/landmarks.md).

In reading order: each walk becomes a ``local_map`` in its own frame, and the maps are joined roughly. ``landmark_map``
adjusts them and the survey at once. ``comparison`` compares a survey, or the sights of walks, with all others, and
``device_metre`` the scales of devices. ``odd_one_out`` finds the greatest contradiction.
"""
