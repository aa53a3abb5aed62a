"""Plots of the inspector: records in, matplotlib figures out. Nothing is shown, nothing global is touched."""
