"""Where landmarks should stand, from the smoother's own model.

A floor's corridor graph becomes ``corridors``; ``sheet_places`` finds the walls along them on which a sheet can hang,
``demands`` what a set of landmarks must fulfil, ``set_cover`` the fewest that do. ``refine`` improves them by the error
to expect on ``typical_walks`` (``prediction``, ``walk_costs``) and picks their walls; ``tour`` orders them for who
hangs them up; ``sigma_map`` and ``further_landmarks`` tell what to expect and what more would help. ``floor`` takes all
these steps; ``records`` is what is written, ``site_files`` what is read from a site and added to it.
"""
