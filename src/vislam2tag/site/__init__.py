"""The site: a building's floors with their plans, landmarks and control points, and where its sessions are.

``discover`` reads the site's files to the ``model``: ``site_file`` and ``floors``, ``landmark_file`` with
``landmark_states`` by way of ``site_table``, plans by ``plans`` and ``plan_formats``. ``corrections`` say what the
survey's owner knows better. ``frame_change`` turns a site into another frame, ``georeference`` places it on the earth,
``links`` looks at links that lead outside, ``walkable`` finds where floors can be walked.
"""
