"""Jobs: in order, one at a time, replaced by newer ones of their name, and never the end of the inspector."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest

from gui.jobs import Job, Jobs, Progress, message_of
from lab import LabError


def with_jobs(test: Callable[[Jobs, list[str], list[str]], Awaitable[None]]) -> None:
    """Runs `test` on a loop with (jobs, stages heard, errors heard)."""

    async def run() -> None:
        heard: list[str] = []
        errors: list[str] = []

        def changed(job: Job | None) -> None:
            heard.append("" if job is None else job.stage)

        jobs = Jobs(changed, lambda name, error: errors.append(f"{name}: {message_of(error)}"))
        try:
            await test(jobs, heard, errors)
        finally:
            jobs.close()

    asyncio.run(run())


def test_results_come_in_order_on_the_loop_and_work_is_done_beside_it() -> None:
    async def test(jobs: Jobs, heard: list[str], errors: list[str]) -> None:
        here, results = threading.get_ident(), []

        def work(progress: Progress) -> int:
            progress("halfway")
            return threading.get_ident()

        def done(worker: int) -> None:
            results.append((worker != here, threading.get_ident() == here))

        jobs.submit("one", work, done)
        jobs.submit("two", work, done)
        await jobs.idle()
        assert results == [(True, True)] * 2 and not errors
        assert "halfway" in heard and heard[-1] == "" and jobs.current is None

    with_jobs(test)


def test_a_newer_job_of_the_name_replaces_the_older() -> None:
    async def test(jobs: Jobs, heard: list[str], errors: list[str]) -> None:
        go, seen = threading.Event(), []

        def slow(progress: Progress) -> str:
            go.wait(10)
            progress("after a change")
            return "old"

        jobs.submit("render", slow, seen.append)
        jobs.submit("other", lambda progress: "other", seen.append)
        jobs.submit("render", lambda progress: "new", seen.append)
        go.set()
        await jobs.idle()
        assert seen == ["other", "new"] and not errors

    with_jobs(test)


def test_cancel_ends_what_runs_and_what_waits() -> None:
    async def test(jobs: Jobs, heard: list[str], errors: list[str]) -> None:
        go, seen = threading.Event(), []

        def slow(progress: Progress) -> str:
            go.wait(10)
            progress("x")
            return "slow"

        jobs.submit("a", slow, seen.append)
        jobs.submit("b", lambda progress: "b", seen.append)
        jobs.cancel()
        go.set()
        await jobs.idle()
        assert seen == [] and not errors
        jobs.submit("c", lambda progress: "c", seen.append)
        await jobs.idle()
        assert seen == ["c"]

    with_jobs(test)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (LabError("alpha=0: allowed is > 0"), "job: alpha=0: allowed is > 0"),
        (MemoryError(), "job: there is not enough memory"),
        (ZeroDivisionError("x"), "job: ZeroDivisionError: x"),
    ],
)
def test_an_error_is_told_and_the_next_job_runs(error: Exception, message: str) -> None:
    async def test(jobs: Jobs, heard: list[str], errors: list[str]) -> None:
        def fail(progress: Progress) -> None:
            raise error

        seen: list[str] = []
        jobs.submit("job", fail, lambda result: seen.append("never"))
        jobs.submit("next", lambda progress: "fine", seen.append)
        await jobs.idle()
        assert seen == ["fine"] and len(errors) == 1 and errors[0].startswith(message)

    with_jobs(test)


def test_an_error_in_what_follows_is_told_too() -> None:
    async def test(jobs: Jobs, heard: list[str], errors: list[str]) -> None:
        def broken(result: int) -> None:
            raise KeyError("panel")

        jobs.submit("job", lambda progress: 1, broken)
        await jobs.idle()
        assert len(errors) == 1 and jobs.current is None

    with_jobs(test)
