"""Command-line output to terminals, pipes and files, and handling of the signals that end the process."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from typing import IO, Any

import click

ENDING = ("SIGTERM", "SIGHUP")
"""Names of the signals that ask a process to clean up and exit; not every system has both."""


class OutputError(click.ClickException):
    """Standard output cannot be written, for example because the disk is full."""

    exit_code = 2

    def __init__(self, failure: OSError) -> None:
        super().__init__(f"standard output cannot be written: {failure.strerror}; free some space or write elsewhere")
        _discard(sys.stdout)

    def show(self, file: IO[str] | None = None) -> None:
        """Print the message in the same format as all others."""
        note(f"error: {self.message}", file)


def say(result: str | bytes) -> None:
    """Print a line, or raw data, to standard output.

    Raises OutputError, and BrokenPipeError if the reader is gone.
    """
    with _output():
        click.echo(result, nl=isinstance(result, str))


def note(words: str, file: IO[str] | None = None) -> None:
    """Print a remark to standard error; failing to write it does no harm and is ignored."""
    try:
        click.echo(words, file=file, err=True)
    except OSError:
        _discard(sys.stderr)


@contextlib.contextmanager
def _output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as failure:
        if failure.filename:
            raise
        raise OutputError(failure) from None


def _discard(stream: IO[str]) -> None:
    """Discard the remaining output of a stream, which the interpreter would otherwise try to flush at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


class Commands(click.Group):
    """A command line that exits cleanly, wherever its output goes and whatever ends it.

    SIGTERM and SIGHUP act like an exception, so nothing unfinished is left behind; the exit code is that of a process
    ended by the signal. Characters missing from the terminal's code page are escaped.
    """

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run the command that the arguments name, then exit."""
        with _ended_by_signals(), _any_character():
            try:
                return super().main(*arguments, **options)
            except OSError as failure:
                if failure.filename:
                    raise
                _discard(sys.stderr)  # one of click's own messages could not be written
                sys.exit(2)

    def invoke(self, ctx: click.Context) -> object:
        """Run the command; an OSError that it does not catch and that names no file is taken to come from its
        output."""
        with _output():
            return super().invoke(ctx)

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Parse the arguments; click prints help from here."""
        with _output():
            return super().make_context(*arguments, **options)


@contextlib.contextmanager
def _any_character() -> Iterator[None]:
    changed = []
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")
            changed.append(stream)
    try:
        yield
    finally:
        for stream in changed:
            with contextlib.suppress(OSError, ValueError):
                stream.reconfigure(errors="strict")


@contextlib.contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Raise SystemExit at the signals of ENDING, unless they are ignored (nohup) or already handled."""
    before: dict[signal.Signals, Any] = {}

    def end(number: int, _: object) -> None:
        for each in before:
            signal.signal(each, signal.SIG_IGN)  # a second signal would interrupt the clean-up
        raise SystemExit(128 + number)

    if threading.current_thread() is threading.main_thread():
        for name in ENDING:
            found = getattr(signal, name, None)
            if found is not None and signal.getsignal(found) == signal.SIG_DFL:
                before[found] = signal.signal(found, end)
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
