"""Work that takes longer than a click: one job at a time on one thread beside the event loop, with progress and cancel.

The core's threads are shared by everything, so that two jobs at once would only make both late; and a record that one
job makes is never half-seen by another.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from lab.errors import LabError
from lab.renderer import Cancelled

T = TypeVar("T")
Progress = Callable[[str], None]


@dataclass(eq=False)
class Job:
    """A job that waits or runs.

    Attributes:
        name: a newer job of the same name takes its place.    stage: what it said last.    started: on the clock of
            time.monotonic, 0 while it waits.
    """

    name: str
    cancelled: bool = False
    stage: str = ""
    started: float = 0.0
    task: asyncio.Task[None] | None = field(default=None, repr=False)

    def cancel(self) -> None:
        """Ends it as soon as it next reports; its result is thrown away."""
        self.cancelled = True


class Jobs:
    """Runs jobs in the order they came. All methods are called on the event loop's thread."""

    def __init__(self, changed: Callable[[Job | None], None], failed: Callable[[str, BaseException], None]) -> None:
        """`changed` hears of the job at work (None: idle); `failed` of a job that ended in an error."""
        self._changed, self._failed = changed, failed
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="inspector")
        self._jobs: list[Job] = []

    @property
    def current(self) -> Job | None:
        """The job at work, or first in line."""
        return self._jobs[0] if self._jobs else None

    def submit(self, name: str, work: Callable[[Progress], T], done: Callable[[T], None]) -> Job:
        """Runs ``work(progress)`` on the worker, then ``done(result)`` here, unless the job was cancelled."""
        for other in self._jobs:
            if other.name == name:
                other.cancel()
        job = Job(name)
        self._jobs.append(job)
        self._tell()
        job.task = asyncio.get_running_loop().create_task(self._run(job, work, done))
        return job

    def cancel(self) -> None:
        """Cancels every job."""
        for job in self._jobs:
            job.cancel()

    async def idle(self) -> None:
        """Waits until nothing runs."""
        while self._jobs:
            tasks = [job.task for job in self._jobs if job.task is not None]
            await asyncio.gather(*tasks, return_exceptions=True)

    def close(self) -> None:
        """Cancels everything and waits for the worker."""
        self.cancel()
        self._worker.shutdown(wait=True, cancel_futures=True)

    async def _run(self, job: Job, work: Callable[[Progress], T], done: Callable[[T], None]) -> None:
        loop = asyncio.get_running_loop()

        def progress(stage: str) -> None:
            if job.cancelled:
                raise Cancelled  # nobody wants its result
            job.stage = stage
            loop.call_soon_threadsafe(self._tell)

        def on_worker() -> Any:
            if job.cancelled:
                raise Cancelled
            job.started = time.monotonic()
            loop.call_soon_threadsafe(self._tell)
            return work(progress)

        try:
            result = await loop.run_in_executor(self._worker, on_worker)
            if not job.cancelled:
                done(result)
        except Cancelled:
            pass
        except Exception as error:  # a job must never end the inspector: whatever it is, the user is told
            if not job.cancelled:
                self._failed(job.name, error)
        finally:
            self._jobs.remove(job)
            self._tell()

    def _tell(self) -> None:
        self._changed(self.current)


def message_of(error: BaseException) -> str:
    """What the user is told: our own errors explain themselves, others are named."""
    if isinstance(error, LabError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; try fewer VPLs or a smaller picture"
    return f"{type(error).__name__}: {error}"
