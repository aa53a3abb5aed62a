"""Our own modelling kit: what the scenes' make.py scripts are built from. Metres, +Y up, deterministic."""
