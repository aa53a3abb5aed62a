"""A bar for work whose end is known: the share that is done, what it is at, and the time it still takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from lab import interrupts

Tell = Callable[[float, str], None]
"""Called with the share that is done, 0 to 1, and a line about it."""


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Tell]:
    """Shows the bar on stderr while this lasts; nothing unless a person watches."""
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda share, line: interrupts.check()
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (
        BarColumn(bar_width=24),
        TaskProgressColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.description}", markup=False),
    )
    # The speed is that of the last minutes: work goes on at another pace when its kind changes.
    with Progress(*columns, console=console, transient=True, speed_estimate_period=120) as bar:
        task = bar.add_task("starting", total=1.0)

        def tell(share: float, line: str) -> None:
            interrupts.check()
            bar.update(task, completed=share, description=line)

        yield tell
