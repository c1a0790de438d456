"""Walks placed on a floor plan by their shape, without landmarks (docs/explanation/floor_plan.md).

In reading order: ``walls`` (what it costs to walk through walls), ``stretches`` (the walk, cut into rigid pieces),
``pose_grid`` (all poses of a piece, and how one follows from another), ``posterior`` (forward-backward over the
pieces), ``evidence`` (taps, landmarks, compass), ``acceptance`` (what is certain enough, and why the rest is not),
``local_poses`` (finer positions) and ``placing`` (all of it, over the floors of a building).
"""
