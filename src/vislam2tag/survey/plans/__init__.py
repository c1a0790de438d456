"""Floor plans: one file per format, all of them turned into one :class:`FloorPlan` in the BCS."""
