"""Running work on several items in copies of this process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from hystgen.basics import parallel

HERE = Path(__file__).resolve().parents[1]


def there(work: str) -> str:
    """A program that runs `work(k)` over eight numbers in two processes, as a command of the package would."""
    return textwrap.dedent("""
        import os, sys, time
        from hystgen.basics import parallel
        {work}
        parallel.each(work, range(8), 2)
        """).format(work=textwrap.dedent(work))


class TestEach:
    def test_results_are_in_the_order_of_the_things(self) -> None:
        def work(k: int) -> tuple[int, int]:
            time.sleep(0.02 * (k % 3 == 0))
            return k * k, os.getpid()

        found = parallel.each(work, range(20), 3)
        assert [square for square, _ in found] == [k * k for k in range(20)]
        assert os.getpid() not in {process for _, process in found}

    def test_one_job_is_a_plain_loop(self) -> None:
        assert parallel.each(lambda _: os.getpid(), range(3), 1) == [os.getpid()] * 3

    def test_a_single_thing_stays_here(self) -> None:
        assert parallel.each(lambda _: os.getpid(), [0], 4) == [os.getpid()]

    def test_nothing_to_do(self) -> None:
        assert parallel.each(lambda k: k, [], 4) == []

    @pytest.mark.parametrize("jobs", [1, 2])
    def test_every_result_is_counted_once(self, jobs: int) -> None:
        ticks: list[int] = []
        parallel.each(lambda k: k, range(7), jobs, lambda: ticks.append(1))
        assert len(ticks) == 7

    def test_what_cannot_be_sent_to_a_process_need_not_be(self) -> None:
        things = [lambda k=k: 2 * k for k in range(4)]
        assert parallel.each(lambda thing: thing(), things, 2) == [0, 2, 4, 6]

    @pytest.mark.parametrize("jobs", [1, 2])
    def test_the_first_of_several_failures_is_raised_here(self, jobs: int) -> None:
        class OwnError(Exception):
            """An error that cannot be copied from its arguments."""

            def __init__(self, k: int, more: str) -> None:
                super().__init__(f"number {k} {more}")

        def work(k: int) -> int:
            if k >= 2:
                raise OwnError(k, "went wrong")
            return k

        with pytest.raises(OwnError, match="number 2 went wrong"):
            parallel.each(work, range(50), jobs)

    def test_what_takes_a_process_down_is_repeated_here(self) -> None:
        first = os.getpid()

        def work(k: int) -> int:
            if k == 3 and os.getpid() != first:
                os.kill(os.getpid(), signal.SIGKILL)
            return k

        assert parallel.each(work, range(6), 2) == list(range(6))

    def test_no_process_is_left(self) -> None:
        processes = set(parallel.each(lambda _: os.getpid(), range(6), 2))
        for process in processes:
            with pytest.raises(ProcessLookupError):
                os.kill(process, 0)


class TestPool:
    @pytest.mark.parametrize("jobs", [1, 2, 3])
    def test_what_follows_from_a_result_is_done_in_the_order_of_a_plain_loop(self, jobs: int) -> None:
        def work(k: int) -> int:
            time.sleep(0.01 * (k % 3 == 0))
            return k * k

        def then(k: int, square: int) -> list[int]:
            assert square == k * k
            return [10 * k, 10 * k + 1] if k % 2 and k < 100 else []

        ticks: list[int] = []
        with parallel.Pool(work, jobs) as pool:
            found = pool.each([1, 2, 3, 5], lambda: ticks.append(1), then)
        order = [1, 2, 3, 5, 10, 11, 30, 31, 50, 51, 110, 111, 310, 311, 510, 511]
        assert found == [(k, k * k) for k in order]
        assert len(ticks) == len(order)

    def test_the_same_processes_do_what_comes_later(self) -> None:
        here: list[int] = []

        def work(k: int) -> tuple[int, int]:
            here.append(k)
            return os.getpid(), len(here)

        with parallel.Pool(work, 2) as pool:
            first = pool.each(range(6))
            second = pool.each(range(6, 20))
            assert pool.each([]) == []
        done = {process: 0 for _, (process, _) in first}
        for _, (process, n) in [*first, *second]:
            assert n == done[process] + 1
            done[process] = n
        assert not here
        for process in done:
            with pytest.raises(ProcessLookupError):
                os.kill(process, 0)

    @pytest.mark.parametrize("taken", [1, 2])
    def test_goes_on_with_fewer_processes(self, taken: int) -> None:
        first = os.getpid()

        def work(k: int) -> bool:
            if k < taken and os.getpid() != first:
                os.kill(os.getpid(), signal.SIGKILL)
            return os.getpid() == first

        with parallel.Pool(work, 2) as pool:
            pool.each(range(2))
            later = pool.each(range(5, 15))
        assert [k for k, _ in later] == list(range(5, 15))
        assert sum(here for _, here in later) == 0

    @pytest.mark.parametrize("able", [0, 1])
    def test_does_with_the_processes_that_can_be_made(self, able: int, monkeypatch: pytest.MonkeyPatch) -> None:
        left, fork = able, os.fork

        def limited() -> int:
            nonlocal left
            left -= 1
            if left < 0:
                raise BlockingIOError(11, "Resource temporarily unavailable")
            return fork()

        monkeypatch.setattr(os, "fork", limited)
        found = parallel.each(lambda k: (k, os.getpid()), range(6), 3)
        assert [k for k, _ in found] == list(range(6))
        assert len({process for _, process in found}) == 1
        assert (found[0][1] == os.getpid()) == (not able)

    @pytest.mark.parametrize("jobs", [1, 2])
    def test_a_failure_of_what_follows_is_raised(self, jobs: int) -> None:
        with parallel.Pool(lambda k: 1 // (3 - k), jobs) as pool, pytest.raises(ZeroDivisionError):
            pool.each([0, 1], then=lambda k, _: [k + 2])


class TestThreads:
    @pytest.fixture(autouse=True)
    def two_cores(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(parallel, "_cores", lambda: 2)

    def test_all_is_done_and_no_thread_is_left(self) -> None:
        done: list[tuple[int, threading.Thread]] = []
        parallel.in_threads(lambda k: done.append((k, threading.current_thread())), range(20))
        assert sorted(k for k, _ in done) == list(range(20))
        assert threading.current_thread() not in [thread for _, thread in done]
        assert not any(thread.is_alive() for _, thread in done)

    def test_nothing_to_do(self) -> None:
        parallel.in_threads(lambda _: pytest.fail("called"), [])

    def test_a_failure_is_raised(self) -> None:
        with pytest.raises(ZeroDivisionError):
            parallel.in_threads(lambda k: 1 // k, [1, 0, 2])


    def test_none_beside_a_pool_at_work(self) -> None:
        def work(seconds: float) -> int:
            time.sleep(seconds)
            threads: set[int] = set()
            parallel.in_threads(lambda _: threads.add(threading.get_ident()) or time.sleep(0.05), range(4))  # type: ignore[func-returns-value]
            return len(threads)

        with parallel.Pool(work, 2) as pool:
            assert pool.each([0.0, 1.0]) == [(0.0, 1), (1.0, 2)]


class TestInterrupt:
    @pytest.mark.parametrize("to_all", [True, False])
    def test_ends_all_processes_and_is_reported_once(self, to_all: bool) -> None:
        program = there("""
            def work(k):
                os.write(1, b"%d\\n" % os.getpid())
                time.sleep(30)
        """)
        with subprocess.Popen(
            [sys.executable, "-c", program], cwd=HERE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        ) as began:  # fmt: skip
            assert began.stdout is not None
            copies = [int(began.stdout.readline()) for _ in range(2)]
            (os.killpg if to_all else os.kill)(began.pid, signal.SIGINT)
            _, said = began.communicate(timeout=20)
        assert began.returncode == -signal.SIGINT
        assert said.count("Traceback") == 1
        for process in copies:
            with pytest.raises(ProcessLookupError):
                os.kill(process, 0)

    def test_copies_end_when_this_process_is_killed(self, tmp_path: Path) -> None:
        program = there(f"""
            def work(k):
                time.sleep(0.2)
                open({str(tmp_path)!r} + f"/{{os.getpid()}}", "a").close()
        """)
        with subprocess.Popen([sys.executable, "-c", program], cwd=HERE) as began:
            while len(list(tmp_path.iterdir())) < 2:
                time.sleep(0.01)
            began.kill()
        end = time.monotonic() + 10.0
        left = [int(path.name) for path in tmp_path.iterdir()]
        while left and time.monotonic() < end:
            left = [process for process in left if Path(f"/proc/{process}/cmdline").is_file()
                    and Path(f"/proc/{process}/cmdline").read_bytes()]  # fmt: skip
            time.sleep(0.05)
        assert not left


class TestCores:
    def test_those_of_this_process(self) -> None:
        assert parallel.cores() in (1, min(len(os.sched_getaffinity(0)), parallel.MOST_PROCESSES))

    def test_one_beside_another_thread(self) -> None:
        done = threading.Event()
        other = threading.Thread(target=done.wait)
        other.start()
        try:
            assert parallel.cores() == 1
        finally:
            done.set()
            other.join()

    def test_one_in_a_copy(self) -> None:
        assert set(parallel.each(lambda _: parallel.cores(), range(4), 2)) == {1}
