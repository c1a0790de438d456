"""The pages of all other commands, one file each."""
