"""Walks, tracker, radio and inertial sensors with known truth.

``scenario`` plans a survey and ``survey`` writes it, of ``choices`` and ``settings`` that users make. A building is
generated (``ground_plan``, ``building``) or made of a site (``site_building``). A true walk follows a ``route``, or a
``floor_tour``, as people walk (``walk``). An AR ``tracker`` logs it: ``tracker_camera`` sees and drifts,
``tracker_faults`` plans what goes wrong, ``tracker_map`` keeps its map. ``radio``, ``beacons``, ``imu``, ``phones`` and
``station`` are everything else that is measured; ``raw_files``, ``phone_log`` and ``phone_script`` write it, with the
``traps`` that real files have. ``model`` is what these parts hand to each other.
"""
