"""The smoother: one robust least-squares problem over a whole walk (docs/explanation/smoother.md).

A log becomes observations: which ``steps`` no camera makes, when landmarks were seen or moved with the map
(``map_moves``), where tracking was lost (``losses``) or came back (``excursions``), the path without all that
(``odometry``), and ``passes`` of landmarks (``observations``). With what the survey says (``landmark_priors``) and how
trackers err (``noise``, ``drift``) they become a linear ``model``, its ``equations``, solved as a ``chain``;
``reweighting`` finds noise levels and weights, ``smoothing`` repeats all this until it has converged. From the solution
follow the states of all frames (``frame_states``), ``slips`` and ``contradictions``.
"""
