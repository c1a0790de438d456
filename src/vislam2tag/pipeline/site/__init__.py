"""Everything before a walk, and what follows from moving a site.

A site begins with ``init``, is looked at with ``show``, which also finds where its floors can be walked; ``plan`` says
where landmarks should stand, ``register`` where they really hang. ``write`` gives its files in another layout or frame,
``rebase`` carries labels and data sets over to a new one.
"""
