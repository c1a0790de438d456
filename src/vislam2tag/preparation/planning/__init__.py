"""Where landmarks should be, from the smoother's own model.

A floor's corridor graph becomes ``corridors``; ``sheet_places`` finds the walls along them on which a sheet can hang,
``demands`` the fewest that fulfil all demands. ``refine`` improves them by the error to expect on typical walks
(``prediction``); a tour over the corridors orders them for hanging. ``floor`` takes all these steps and follows changes
by hand; ``records`` is what is read and written.
"""
