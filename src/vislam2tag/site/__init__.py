"""The survey: a site with floors, landmarks and control points, and where its sessions lie.

``discover`` reads the site's files (``site_file``, ``site_floors`` and ``floor_file``; ``landmark_file`` by way of
``site_table``; ``plans``) to the ``model``; ``corrections`` say what their owner knows
better. ``frame_change`` and ``changed_files`` turn a site into another frame, ``georeference`` places it on the earth.
"""
