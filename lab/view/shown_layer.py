"""Which layer the window shows, and how tev's keys change that."""

from __future__ import annotations

from lab.layers import find_layer

FIRST = "colour"


class ShownLayer:
    """One of the layers that the frame has.

    Attributes:
        name: of the one that is shown.    names: of all, in the order of menus.

    """

    def __init__(self) -> None:
        self.name = FIRST
        self.names: tuple[str, ...] = (FIRST,)

    def offer(self, names: list[str]) -> None:
        """These can be shown now; where the one that was can't any more, the first one is."""
        self.names = tuple(names)
        if self.name not in self.names:
            self.name = FIRST

    def choose(self, name: str) -> None:
        """Shows `name`, if it is offered."""
        if name in self.names:
            self.name = name

    def press(self, key: str) -> bool:
        """Takes a key; False if it is none of its own."""
        mates = self._of(find_layer(self.name).group)
        if key.isdecimal() and key != "0":
            if int(key) <= len(mates):
                self.name = mates[int(key) - 1]
        elif key in ("left", "right"):
            self.name = mates[(mates.index(self.name) + (1 if key == "right" else -1)) % len(mates)]
        elif key in ("up", "down"):
            groups = list(dict.fromkeys(find_layer(name).group for name in self.names))
            at = groups.index(find_layer(self.name).group)
            self.name = self._of(groups[(at + (1 if key == "down" else -1)) % len(groups)])[0]
        else:
            return False
        return True

    def _of(self, group: str) -> list[str]:
        return [name for name in self.names if find_layer(name).group == group]
