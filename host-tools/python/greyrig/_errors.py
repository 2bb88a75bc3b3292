"""Errors, with the sentences of the command line."""

from __future__ import annotations


class Error(Exception):
    """Something that the user can act on.

    ``str(error)`` is the sentence of the command line: where it is, what is wrong, and what to do.
    """

    place: str | None
    """File, with line and column where they are known."""
    what: str
    """What is wrong."""
    remedy: str
    """What to do about it."""
    code: int
    """Exit code of the command: 2 wrong usage or bad input, 3 trouble with the hardware."""

    def __init__(self, sentence: str, place: str | None, what: str, remedy: str, code: int) -> None:
        super().__init__(sentence)
        self.place, self.what, self.remedy, self.code = place, what, remedy, code

    def __str__(self) -> str:
        return str(self.args[0])

    def __reduce__(self) -> tuple[type[Error], tuple[str, str | None, str, str, int]]:
        return type(self), (str(self), self.place, self.what, self.remedy, self.code)


class InputError(Error, ValueError):
    """A file, or what it stands for in memory, holds something that cannot be used."""


class InsufficientError(Error, ValueError):
    """Recordings do not hold what is asked of them."""


class UsageError(Error, ValueError):
    """Something impossible is asked for."""


class FileError(Error, OSError):
    """The system refuses a file."""


class LinkError(Error, OSError):
    """The hardware, or the link to it, does not do what it should."""
