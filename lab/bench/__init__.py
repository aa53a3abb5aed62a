"""The stages of a frame against the limits of the machine, measured in one run (``lab bench``).

``definitions`` says what is computed, ``measure`` takes turns at measuring it, ``ratios`` computes it from the record.
"""
