"""Walks, tracker, radio and inertial sensors with known truth.

``scenario`` plans a survey and ``survey`` writes it, of ``settings`` that users make. A building is generated
(``ground_plan``, ``building``) or made of a site (``site_building``). A true walk follows a ``route`` as people walk
(``walk``). An AR ``tracker`` logs it, and keeps its map: ``tracker_camera`` sees and drifts, ``tracker_faults`` plans
what goes wrong. ``radio``, ``imu``, ``phones`` and ``station`` are everything else that is measured; ``raw_files`` and
``phone_log`` write it, with the ``traps`` that real files have. ``model`` is what these parts hand to each other.
"""
