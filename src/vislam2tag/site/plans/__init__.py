"""Floor plans, all of them turned into one :class:`FloorPlan` in the BCS.

``source`` (from ``site.toml``) names a floor's file; one of ``vislam2tag.site.plan_formats`` reads it to a ``drawing``
in the file's own coordinates, in a ``reader_process``; ``images`` draws it; ``load`` takes all these steps.
"""
