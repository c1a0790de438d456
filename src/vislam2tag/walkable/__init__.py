"""Where a floor can be walked: from plan to mask, walls and a graph of corridors."""
