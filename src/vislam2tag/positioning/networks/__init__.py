"""Neural networks: training, devices, and the modules that answer. All of it needs the extra ``models`` (PyTorch)."""
