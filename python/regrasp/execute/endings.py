"""What ends a part of a run before its end."""

from __future__ import annotations


class GiveUp(Exception):
    """Nothing helps; the object is held."""

    def __init__(self, status: str, message: str) -> None:
        super().__init__(message)
        self.status = status


class Withdrawn(Exception):
    """The goal is not wanted any more."""


class GoOn(Exception):
    """There is no start here, or no plan from here, and the leg that was stopped may go on."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind
        """The event: ``no_start`` or ``no_plan``."""
