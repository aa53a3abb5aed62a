"""Flying through a scene in real time: what the window shows, what keys and panel do, and the loop of frames.

The window itself, and what the device does for it, is in :mod:`lab.engine.vulkan.window`.
"""
