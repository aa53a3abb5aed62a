"""The Vulkan engine: the seven stages on a graphics card, in Slang shaders driven by slangpy.

Nothing outside of this package imports slangpy, and nothing in it imports slangpy before a device is asked for.
"""
