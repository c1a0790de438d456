"""What the formats that are written are made of."""
