"""Modules without types, as untyped ones: pyarrow, and what is imported where it is needed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

pa: Any = import_module("pyarrow")
pq: Any = import_module("pyarrow.parquet")
