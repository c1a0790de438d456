"""What a DXF drawing contains: names of layers and blocks, what it shows, and what each line stands for."""
