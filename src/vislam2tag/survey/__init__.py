"""The survey: a site with floors, landmarks and control points, and where its sessions lie.

``discover`` looks at a folder: ``site_file`` and ``site_floors`` read a ``site.toml``, ``floor_file`` and
``landmark_file`` (by ``site_table``) the published layout, ``plans`` the floor plans, into a ``model``; ``names``
makes file names of sessions. ``corrections`` say what the owner knows better. ``frame_change`` leads from a floor's
old frame to its new one, ``changed_files`` writes site files in it, ``georeference`` leads to longitude and latitude.
``sheet_size`` is the paper that landmarks are printed on.
"""
