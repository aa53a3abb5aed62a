"""The keys of the window. Layers and exposure as in the image viewer tev, flying as in games."""

from __future__ import annotations

KEYS = (
    ("w a s d", "fly ahead, left, back, right"),
    ("space, q", "up, down"),
    ("shift", "held with those: four times as fast"),
    ("mouse", "hold a button over the picture to look around; e is up meanwhile"),
    ("wheel", "slower, faster"),
    ("r", "back to the first view"),
    ("p", "print the camera, as --camera and scene.toml take it"),
    ("1 ... 9", "the layer of that number"),
    ("right, left", "the next layer, the one before"),
    ("down, up", "the next kind of layers, the one before"),
    ("e, shift+e", "half a stop brighter, darker"),
    ("f", "the exposure that suits this picture"),
    ("f12", "save the picture, without the panel"),
    ("tab", "hide or show the panel"),
    ("h", "these keys"),
    ("escape", "end"),
)
"""Keys, and what they do."""


def key_lines() -> tuple[str, ...]:
    """One line a key, for a font whose letters have different widths."""
    return tuple(f"{key}:  {what}" for key, what in KEYS)


def key_table(indent: str = "  ") -> str:
    """The keys in two columns."""
    width = max(len(key) for key, _ in KEYS)
    return "\n".join(f"{indent}{key:<{width}}  {what}" for key, what in KEYS)
