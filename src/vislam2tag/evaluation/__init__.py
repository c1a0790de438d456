"""How good labels are, against truth."""
