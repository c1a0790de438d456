"""Label errors before a total station: its files, its frame, its clock, the camera's true places."""
