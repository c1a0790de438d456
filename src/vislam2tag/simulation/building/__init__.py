"""Where simulated walks lead: buildings generated, or made of a site."""
