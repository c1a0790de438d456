"""Raw formats of sessions: one file each."""
