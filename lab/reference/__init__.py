"""References: what a picture should look like, with its own error bars.

``path_traced`` knows no virtual lights at all; ``brute_force`` sums all of them with every shadow ray. Both refine as
long as a :class:`Budget` allows; :func:`render_reference` keeps what was reached on disk and goes on from there.
"""

from lab.reference.estimate import Budget, Reference
from lab.reference.methods import brute_force, path_traced
from lab.reference.path_tracer import PIXELS
from lab.reference.stored import METHODS, SETTINGS_THAT_COUNT, cache_folder, render_reference

__all__ = [
    "METHODS",
    "PIXELS",
    "SETTINGS_THAT_COUNT",
    "Budget",
    "Reference",
    "brute_force",
    "cache_folder",
    "path_traced",
    "render_reference",
]
