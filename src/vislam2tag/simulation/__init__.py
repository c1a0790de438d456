"""Walks, tracker, radio and inertial sensors with known truth.

- ``scenario`` plans a survey from ``settings``, and ``survey`` writes it.
- Buildings are generated (``ground_plan``, ``building``) or made from a site (``site_building``).
- ``route`` and ``walk`` make the true walk of a person.
- ``tracker`` logs the walk as an AR tracker and keeps its map; ``tracker_camera`` models sightings and drift,
  ``tracker_faults`` plans faults.
- ``radio``, ``imu``, ``phones`` and ``station`` model the other measurements.
- ``raw_files`` and ``phone_log`` write everything, with the ``traps`` of real files.
- ``model`` defines the data that these parts exchange.
"""
