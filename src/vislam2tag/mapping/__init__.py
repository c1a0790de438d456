"""From a session's log to a trajectory in the building: the strategy protocol (``registry``), one file for each of
``strategies``, and what the paper's strategies build their trajectories with (``trajectory_builder``).
"""
