"""Hands of the package `robot_descriptions`, by name: `load_hand("allegro_hand_description")`."""

# What is fetched has no types.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import difflib
import os
import re
import tempfile
from importlib import import_module
from types import ModuleType
from typing import Any

from ._arguments import StrPath
from ._errors import argument_error

NAME = re.compile(r"[A-Za-z0-9_+]+_description")
"""How that package names its modules; no file of ours is called so."""


def is_description(path: StrPath) -> bool:
    """Whether `path` is the name of a description rather than a file."""
    return isinstance(path, str) and NAME.fullmatch(path) is not None and not os.path.exists(path)


def fetched(name: str) -> ModuleType:
    """The module called `name`, whose import fetches the files of the robot once and keeps them.

    Raises `ImportError` without the package, `InputError` (A510) for an unknown name and for files that cannot be fetched.
    """
    try:
        import_module("robot_descriptions")
    except ModuleNotFoundError as error:
        message = f'"{name}" is a name of the package robot_descriptions, which is not installed: pip install robot_descriptions'
        raise ImportError(message, name="robot_descriptions") from error
    try:
        return import_module(f"robot_descriptions.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"robot_descriptions.{name}":
            raise
        raise _refused(f'is "{name}", which robot_descriptions does not have', _expected(name)) from error
    except Exception as error:
        # Git's errors, of the network among them, come as they are.
        problem = f'is "{name}", whose files cannot be fetched: {error}'
        raise _refused(problem, "a network, or files that were fetched before") from error


def _expected(name: str) -> str:
    known: dict[str, Any] = getattr(_descriptions(), "DESCRIPTIONS", {})
    hands = [other for other, about in known.items() if "end_effector" in getattr(about, "tags", ())]
    meant = difflib.get_close_matches(name, list(known), 1)
    hint = f' (did you mean "{meant[0]}"?)' if meant else ""
    return (
        f"a name of its list{hint}; its hands and grippers are {', '.join(sorted(hands))}"
        if hands
        else f"a name of its list{hint}"
    )


def _descriptions() -> ModuleType | None:
    try:
        return import_module("robot_descriptions._descriptions")
    except ImportError:
        return None


def _refused(problem: str, expected: str) -> Exception:
    return argument_error("load_hand", "path", problem, expected)


def model_file(module: ModuleType) -> str:
    """Its URDF; else its xacro, which the reader refuses with the command that expands it; else its MJCF."""
    for attribute in ("URDF_PATH", "XACRO_PATH", "MJCF_PATH"):
        path = getattr(module, attribute, None)
        if isinstance(path, str):
            return path
    name = module.__name__.rpartition(".")[2]
    raise _refused(
        f'is "{name}", which has neither URDF_PATH nor MJCF_PATH', "a description with a URDF or a MJCF file"
    )


def packages_of(module: ModuleType) -> tuple[dict[str, str], list[str]]:
    """Where `package://` leads in its URDF: packages by name, and folders of packages."""
    package, repository = (getattr(module, name, None) for name in ("PACKAGE_PATH", "REPOSITORY_PATH"))
    named = {os.path.basename(folder): folder for folder in (repository, package) if isinstance(folder, str)}
    named = {name: folder for name, folder in named.items() if name and os.path.isdir(folder)}
    above = [os.path.dirname(folder) for folder in named.values()]
    return named, [*named.values(), *above]


def converted(path: str) -> tuple[str, tempfile.TemporaryDirectory[str]]:
    """A hand file for the MJCF file at `path`, in a folder that the caller keeps as long as it is read."""
    from .from_mjcf import convert

    folder = tempfile.TemporaryDirectory(prefix="regrasp-")
    try:
        made = convert(path, os.path.join(folder.name, "hand"))
        if made.problem is not None:
            raise made.problem
    except BaseException:
        folder.cleanup()
        raise
    return os.fspath(made.hand_file or made.urdf), folder
