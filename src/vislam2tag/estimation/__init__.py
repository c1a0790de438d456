"""From a session's log to a trajectory in the building: smoother, dead reckoning, heights, joint landmark surveys.

- Observations: ``steps`` finds steps that are not motion, ``map_moves`` rewrites of the tracker's map. ``odometry``
  makes a continuous path, and ``observations`` condenses passes of landmarks.
- Estimation: ``landmark_priors`` contains the survey, ``tracker_errors`` the noise model, ``factors`` the least-squares
  problem that ``smoother`` solves. ``reweighting`` estimates noise levels and robust weights; ``least_squares``
  contains the solvers.
- Results: ``frame_states`` computes the states of all frames, ``fault_detection`` wrong landmarks, ``vertical`` and
  ``heights`` height and floor.
- ``dead_reckoning`` maps walks without a tracker, and ``landmark_survey`` joins the landmarks of many walks.
- ``strategies`` contains all mapping strategies by name, ``strategy`` their protocol, and ``settings`` the settings.
"""
