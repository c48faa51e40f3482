"""A strict reader of TOML tables: every error has code, line, key, value, what was expected and what to do.

Codes: D100 not TOML, D101 unknown key, D102 missing key, D103 wrong type, D104 unknown word, D105 another format,
D106 number out of range, D107 name used twice.
"""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from .. import _regrasp
from .._errors import Diagnostic, InputError


def text_of(diagnostic: Diagnostic) -> str:
    """As the command line prints it."""
    place = diagnostic.file + (f":{diagnostic.line}" if diagnostic.line is not None else "")
    element = f" {diagnostic.element}" if diagnostic.element else ""
    expected = f"; expected {diagnostic.expected}" if diagnostic.expected else ""
    fix = f"\n  fix: {diagnostic.fix}" if diagnostic.fix else ""
    return f"{diagnostic.code} {place}{element}: {diagnostic.problem}{expected}{fix}"


def error_of(*diagnostics: Diagnostic) -> InputError:
    """All of them together."""
    return InputError("\n".join(text_of(each) for each in diagnostics), tuple(diagnostics))


def fault(code: str, file: str, problem: str, *, expected: str = "", fix: str = "", element: str = "") -> InputError:
    """One thing that is wrong with a file."""
    return error_of(Diagnostic(code, file, None, None, element, problem, expected, fix))


@dataclass
class File:
    """A TOML file and what was found wrong with it."""

    path: str
    lines: dict[str, int]
    """The line of every key, by its dotted path."""
    found: list[Diagnostic] = field(default_factory=list[Diagnostic])

    def report(self, code: str, path: str, problem: str, expected: str = "", fix: str = "") -> None:
        """Notes an error at the key `path`, or at the nearest key around it."""
        at = path
        while at and at not in self.lines:
            at = at[: max(at.rfind("."), at.rfind("["), 0)]
        element = f'key "{path}"' if path else ""
        self.found.append(Diagnostic(code, self.path, self.lines.get(at), None, element, problem, expected, fix))

    def raise_if_wrong(self) -> None:
        """Raises what was found."""
        if self.found:
            raise error_of(*self.found)


def parse(text: str, path: str) -> tuple[File, Table]:
    """The root table of a TOML file. Raises `InputError` (D100)."""
    document = json.loads(_regrasp.parse_toml(text, path, "D100"))
    file = File(path, document["lines"])
    return file, Table(file, "", document["value"])


class Table:
    """A table; every key is asked for by name, and `finish` refuses the others."""

    def __init__(self, file: File, path: str, values: dict[str, Any]) -> None:
        self.file = file
        self.path = path
        self.values = values
        self._asked: list[str] = []

    def at(self, key: str) -> str:
        """The dotted path of a key."""
        return f"{self.path}.{key}" if self.path else key

    def report(self, code: str, key: str, problem: str, expected: str = "", fix: str = "") -> None:
        """Notes an error at `key`."""
        self.file.report(code, self.at(key), problem, expected, fix)

    def get(self, key: str) -> Any:
        """The value of a key that may be left out."""
        self._asked.append(key)
        return self.values.get(key)

    def _checked(self, key: str, default: Any, kind: type | tuple[type, ...], expected: str, fix: str) -> Any:
        value = self.get(key)
        if value is None:
            if fix:
                self.report("D102", key, "is missing", expected, fix)
            return default
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            self.report("D103", key, f"is {short(value)}", expected)
            return default
        return value

    def text(self, key: str, default: str | None = None, *, fix: str = "", choices: Sequence[str] = ()) -> str | None:
        """A text, one of `choices` where there are any. With `fix` the key has to be there."""
        expected = ", ".join(f'"{choice}"' for choice in choices) if choices else "a text"
        value = self._checked(key, default, str, expected, fix)
        if choices and value is not None and value not in choices:
            near = difflib.get_close_matches(value, choices, 1)
            self.report("D104", key, f'is "{value}"', expected, f'did you mean "{near[0]}"?' if near else "")
            return default
        return value

    def whole(self, key: str, default: int, low: int, high: int, *, fix: str = "") -> int:
        """A whole number."""
        value = self._checked(key, default, int, f"a whole number from {low} to {high}", fix)
        if not low <= value <= high:
            self.report("D106", key, f"is {value}", f"a whole number from {low} to {high}")
            return default
        return value

    def number(self, key: str, is_right: Callable[[float], bool], expected: str) -> float | None:
        """A number that may be left out."""
        value = self._checked(key, None, (int, float), expected, "")
        if value is not None and not (math.isfinite(value) and is_right(value)):
            self.report("D106", key, f"is {short(value)}", expected)
            return None
        return value

    def flag(self, key: str) -> bool:
        """True or false; false where it is left out."""
        return bool(self._checked(key, False, bool, "true or false", ""))

    def table(self, key: str) -> Table:
        """A table; empty where it is left out."""
        return Table(self.file, self.at(key), self._checked(key, {}, dict, "a table", ""))

    def tables(self, key: str, fix: str) -> list[Table]:
        """Tables `[[key]]`, at least one."""
        entries = cast("list[Any]", self._checked(key, [], list, f"tables [[{key}]]", fix))
        made: list[Table] = []
        for k, entry in enumerate(entries):
            if isinstance(entry, dict):
                made.append(Table(self.file, f"{self.at(key)}[{k}]", cast("dict[str, Any]", entry)))
            else:
                self.file.report("D103", f"{self.at(key)}[{k}]", f"is {short(entry)}", "a table")
        return made

    def finish(self) -> None:
        """Refuses every key that nobody asked for."""
        for key in self.values:
            if key not in self._asked:
                near = difflib.get_close_matches(key, self._asked, 1)
                self.report("D101", key, "is unknown", ", ".join(self._asked), f'did you mean "{near[0]}"?' if near else "")


def short(value: Any) -> str:
    """A value as messages quote it."""
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else text[:57] + "..."
