"""Sessions: what one walk recorded, and one reader per raw format."""
