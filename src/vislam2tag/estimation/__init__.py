"""From a session's log to a trajectory in the building: the smoother, dead reckoning, heights, joint landmark surveys.

In reading order: ``steps`` that no camera makes, ``map_moves`` of a rewritten map, the path without all that
(``odometry``) and passes of landmarks (``observations``). With what the survey says (``landmark_priors``) and how
trackers err (``tracker_errors``) they become the ``factors`` of one least-squares problem, which the ``smoother``
solves; ``reweighting`` finds noise levels and robust weights. From the solution follow the states of all frames
(``frame_states``) and wrong landmarks (``fault_detection``). ``vertical`` and ``heights`` find height and floor.
``least_squares`` solves what either comes to.

``dead_reckoning`` maps walks without a tracker, ``landmark_survey`` joins the landmarks of many walks, ``strategies``
are all mapping strategies by name, and ``strategy`` is their protocol; ``settings`` has what all these assume.
"""
