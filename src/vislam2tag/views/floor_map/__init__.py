"""The map of a floor in pages: plan, layers, arrows."""
