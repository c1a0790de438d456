"""A model that answers over HTTP on this computer: messages -> answers -> application, and its page."""
