"""The settings of the window: what was asked for last, and what the last good frame had."""

from __future__ import annotations

from lab.errors import LabError
from lab.params import SETTINGS, Params, Value, preset


class ViewSettings:
    """Settings that may turn out to be wrong only when a frame is rendered with them.

    Attributes:
        params: asked for.    preset: the one chosen last.    usual: its settings, with what the command line changed.
        message: what was wrong with the last change, "" for nothing.

    """

    def __init__(self, params: Params, preset_name: str) -> None:
        self.params = self.usual = params
        self.preset = preset_name
        self.message = ""
        self._good = params

    def set(self, name: str, value: Value) -> None:
        """Changes one setting; a refused value leaves it as it is, and `message` says why."""
        try:
            self.params = self.params.replace(**{name: value})
            self.message = ""
        except LabError as error:
            self.message = str(error)

    def choose_preset(self, name: str) -> None:
        """Starts from a preset; the random numbers stay."""
        self.preset = name
        self.params = self.usual = preset(name, seed=self.params.seed, frame=self.params.frame)
        self.message = ""

    def reset(self, names: tuple[str, ...]) -> None:
        """These settings as they usually are."""
        usual = self.usual.to_dict()
        self.params = self.params.replace(**{name: usual[name] for name in names})
        self.message = ""

    def next_frame(self) -> None:
        """Other shadow samples."""
        most = int(SETTINGS["frame"].high)
        self.params = self.params.replace(frame=(self.params.frame + 1) % (most + 1))

    def accept(self) -> None:
        """A frame was rendered with these."""
        self._good = self.params

    def refuse(self, message: str) -> None:
        """No frame could be rendered with these: the last good ones again."""
        self.params, self.message = self._good, message
