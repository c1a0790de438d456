"""Walks placed on a floor plan by their shape, without landmarks (docs/explanation/floor_plan.md).

In reading order, after :mod:`vislam2tag.core.wall_costs`:

- ``stretches`` cuts the walk into rigid pieces;
- ``pose_grid`` contains all poses of a piece, and how one follows from another; ``posterior`` is forward-backward;
- ``evidence`` and ``facts`` are taps, landmarks, compass and other walks;
- ``acceptance`` decides what is certain enough, and why the rest is not; ``samples`` are whole paths;
- ``local_poses`` are finer positions, and ``placing`` is all of it, over the floors of a building.
"""
