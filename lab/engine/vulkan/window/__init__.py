"""The window of ``lab view``: what the system, the device and the panel make of it. What it shows: :mod:`lab.view`."""
