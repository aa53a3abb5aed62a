"""How quickly the inspector answers, as seen in the browser: medians in milliseconds, until the new picture is drawn.

    python -m tests.gui.response_times shared/scenes/sponza.glb --set vpls=100000

takes what ``lab inspect`` takes, and `-n` how often each is measured. No test: times depend on the machine.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from .browser import WINDOW, Server, Tab, open_browser, play

# What an image shows, small: an address may change while the old picture is sent once more.
_SHOWN = """(selector) => {
  const image = document.querySelector(selector), canvas = document.createElement("canvas");
  canvas.width = 160; canvas.height = 90;
  const pen = canvas.getContext("2d");
  if (!image || !image.complete || !image.naturalWidth) return "";
  pen.drawImage(image, 0, 0, 160, 90);
  return canvas.toDataURL();
}"""
# Calls back once the image that `selector` finds shows something else than `before`, and that is on the screen.
_WAIT = (
    "([selector, before]) => new Promise((done) => { const shown = "
    + _SHOWN
    + """;
  const look = () => {
    const now = shown(selector);
    requestAnimationFrame(now === "" || now === before ? look : () => done(""));
  };
  look();
})"""
)
_ROWS = """(before) => new Promise((done) => {
  const look = () => {
    const cell = document.querySelector("#pixel-summary td:nth-child(2)");
    if (!cell || cell.innerText === before) return requestAnimationFrame(look);
    requestAnimationFrame(() => done(cell.innerText));
  };
  look();
})"""


def measure(tab: Tab, times: int) -> dict[str, list[float]]:
    """Milliseconds of each answer."""
    alphas, levels = [1.1, 1.0], ["ArrowRight", "ArrowLeft"]

    def timed(act: Callable[[], None], wait: Callable[[], object]) -> float:
        begun = time.perf_counter()
        act()
        wait()
        taken = 1000 * (time.perf_counter() - begun)
        tab.idle()
        tab.page.wait_for_timeout(600)  # what comes after the answer is not to be in the next one's way
        return taken

    def image(selector: str) -> Callable[[], object]:
        before = tab.page.evaluate(_SHOWN, selector)
        return lambda: tab.page.evaluate(_WAIT, [selector, before])

    def pixel(n: int) -> float:
        before = tab.text("#pixel-summary td:nth-child(2)")
        box = tab.box(".lab-image-a")
        at = box["x"] + box["width"] * (0.35 + 0.03 * n), box["y"] + box["height"] * 0.6
        return timed(lambda: tab.page.mouse.click(*at), lambda: tab.page.evaluate(_ROWS, before))

    def level(n: int) -> float:
        return timed(lambda: tab.slide("#level-slider", levels[n % 2]), image("#scene img"))

    def parameter(n: int) -> float:
        return timed(lambda: tab.write("#param-alpha", alphas[n % 2]), image(".lab-image-a"))

    parts = {"level slider": level, "pixel probe": pixel, "parameter (alpha)": parameter}
    return {name: [part(n) for n in range(times)] for name, part in parts.items()}


def tell(line: str) -> None:
    """Prints at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Starts an inspector and a browser, and prints a table."""
    parser = argparse.ArgumentParser(description="how quickly the inspector answers")
    parser.add_argument("-n", dest="times", type=int, default=9, help="how often each is measured (default: 9)")
    known, rest = parser.parse_known_args()
    rest = [str(Path(word).resolve()) if Path(word).exists() else word for word in rest]
    with tempfile.TemporaryDirectory() as folder, play() as player:
        begun = time.perf_counter()
        server = Server(Path(folder), rest, patience_s=180)
        try:
            tell(f"{'address printed after':<22}{1000 * (time.perf_counter() - begun):8.0f} ms")
            browser = open_browser(player)
            tab = Tab(browser.new_page(viewport=WINDOW), server)
            tell(f"{'first picture after':<22}{1000 * (time.perf_counter() - begun):8.0f} ms")
            tab.idle()
            for name, taken in measure(tab, known.times).items():
                tell(f"{name:<22}{statistics.median(taken):8.0f} ms   {min(taken):.0f} to {max(taken):.0f}")
            browser.close()
        finally:
            server.end()


if __name__ == "__main__":
    main()
