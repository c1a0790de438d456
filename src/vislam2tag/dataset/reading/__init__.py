"""What the formats that are read are made of."""
