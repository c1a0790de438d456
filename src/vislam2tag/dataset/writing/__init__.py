"""What several formats that are written share: labelled samples, parts of a split, and what is left out."""
