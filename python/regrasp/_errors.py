"""What is raised. Failing to find a plan is no error: see `Failure`."""

# pyright: reportUnusedFunction=false

from __future__ import annotations

import json
from dataclasses import dataclass


class RegraspError(Exception):
    """Base of everything that regrasp raises."""


@dataclass(frozen=True)
class Diagnostic:
    """One thing that is wrong with an input."""

    code: str
    """Stable code, such as "U120"; CONVENTIONS.md lists the families."""
    file: str
    """The file, as it was named, or the function whose argument is meant."""
    line: int | None
    """Line, from 1, where known."""
    column: int | None
    """Column, from 1, where known."""
    element: str
    """What is meant: 'joint "j2"', 'key "friction"'; empty for a whole file."""
    problem: str
    """What is wrong, with the value seen."""
    expected: str
    """What would have been right; may be empty."""
    fix: str
    """What to do; may be empty."""


class InputError(RegraspError, ValueError):
    """A file or an argument that cannot be used. `str` of it is what the command line prints, every cause in it.

    The attributes `code`, `file`, `line`, `column`, `element`, `problem`, `expected` and `fix` are those of the first cause.
    """

    def __init__(self, message: str, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__(message, diagnostics)
        self.diagnostics = diagnostics

    def __str__(self) -> str:
        return str(self.args[0])

    @property
    def code(self) -> str:
        return self.diagnostics[0].code

    @property
    def file(self) -> str:
        return self.diagnostics[0].file

    @property
    def line(self) -> int | None:
        return self.diagnostics[0].line

    @property
    def column(self) -> int | None:
        return self.diagnostics[0].column

    @property
    def element(self) -> str:
        return self.diagnostics[0].element

    @property
    def problem(self) -> str:
        return self.diagnostics[0].problem

    @property
    def expected(self) -> str:
        return self.diagnostics[0].expected

    @property
    def fix(self) -> str:
        return self.diagnostics[0].fix


class InternalError(RegraspError):
    """A broken invariant: a bug in regrasp. The text says what a report of it needs."""


def _input_error(message: str, diagnostics: str) -> InputError:
    """Called by the native module, with the diagnostics as JSON."""
    return InputError(message, tuple(Diagnostic(**entry) for entry in json.loads(diagnostics)))


def argument_error(function: str, name: str, problem: str, expected: str) -> InputError:
    """An argument that makes no sense (A510)."""
    diagnostic = Diagnostic("A510", function, None, None, f'argument "{name}"', problem, expected, "")
    return InputError(f'A510 {function} argument "{name}": {problem}; expected {expected}', (diagnostic,))
