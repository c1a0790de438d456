"""Height and floor of every frame: vertical axis -> rides -> floors -> estimate."""
