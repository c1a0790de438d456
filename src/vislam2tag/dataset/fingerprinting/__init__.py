"""From the labelled tables of a walk to fingerprints, magnetic ones among them."""
