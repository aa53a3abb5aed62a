"""Every layer of a frame as a picture with its legend: records in, pixels out. No browser, no window.

layers = FrameLayers(frame, engine)
layers.names                               # what this frame has
shown = layer_picture(layers, "overdraw")
shown.pixels, shown.legend, shown.stats, shown.value_at(x, y)
"""

from gui.layers.colour_maps import COLOUR_MAPS
from gui.layers.encode import data_url, jpeg_bytes, png_bytes
from gui.layers.frame_layers import FrameLayers, layer_names, layer_values
from gui.layers.picture import LayerPicture, draw_layer, layer_picture
from gui.layers.read_out import value_at
from gui.layers.scale import Scale, scale_for
from lab.layers import LAYERS, Layer, find_layer
from lab.pixel_stats import pixel_stats as stats

__all__ = [
    "COLOUR_MAPS",
    "LAYERS",
    "FrameLayers",
    "Layer",
    "LayerPicture",
    "Scale",
    "data_url",
    "draw_layer",
    "find_layer",
    "jpeg_bytes",
    "layer_names",
    "layer_picture",
    "layer_values",
    "png_bytes",
    "scale_for",
    "stats",
    "value_at",
]
