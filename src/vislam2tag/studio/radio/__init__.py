"""Radio maps of labels, as the page sees them."""
