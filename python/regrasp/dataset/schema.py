"""Columns of a data set. One row is one episode; `docs/reference/dataset-format.md` lists them with units and frames."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from ._arrow import pa, pq
from .packing import DIGITS, Row

#: Of the layout of columns; part of the name of every shard.
SHARD_VERSION = 1
#: The key of the metadata of a shard that says what it is.
METADATA_KEY = b"regrasp"
COMPRESSION_LEVEL = 12

_FLOATS = pa.list_(pa.float64())
FIELDS: tuple[tuple[str, Any], ...] = (
    ("task", pa.string()),
    ("episode", pa.int64()),
    ("key", pa.string()),
    ("seed", pa.int64()),
    ("values", pa.string()),
    ("outcome", pa.string()),
    ("solved", pa.bool_()),
    ("message", pa.string()),
    ("causes", pa.string()),
    ("nearest_angle", pa.float64()),
    ("nearest_distance", pa.float64()),
    ("nearest_joints", _FLOATS),
    ("work", pa.int64()),
    ("method", pa.string()),
    ("object_kind", pa.string()),
    ("object_size", _FLOATS),
    ("object_mass", pa.float64()),
    ("object_friction", pa.float64()),
    ("start_pose", _FLOATS),
    ("goal_pose", _FLOATS),
    ("goal_angle", pa.float64()),
    ("duration", pa.float64()),
    ("n_waypoints", pa.int32()),
    ("transfers", pa.int32()),
    ("relocations", pa.int32()),
    ("margin", pa.float64()),
    ("clearance", pa.float64()),
    ("slip", pa.float64()),
    ("digits", pa.int8()),
    ("plan", pa.string()),
    ("segment", pa.list_(pa.int16())),
    ("contact_modes", pa.list_(pa.int8())),
    *((name, _FLOATS) for name in DIGITS),
)
REPLAY_FIELDS: tuple[tuple[str, Any], ...] = (
    ("replay_controller", pa.string()),
    ("replay_friction_scale", pa.float64()),
    ("replay_mass_scale", pa.float64()),
    ("replay_start_offset", _FLOATS),
    ("replay_start_turn", _FLOATS),
    ("replay_kept", pa.bool_()),
    ("replay_cause", pa.string()),
    ("replay_final_position_error", pa.float64()),
    ("replay_final_angle_error", pa.float64()),
    ("replay_largest_slip", pa.float64()),
    ("replay_contacts_lost", pa.int32()),
    ("replay_tick", pa.float64()),
    ("replay_joints", _FLOATS),
    ("replay_object_pose", _FLOATS),
)
SCHEMA = pa.schema([pa.field(name, kind) for name, kind in (*FIELDS, *REPLAY_FIELDS)])


def empty_row() -> Row:
    """All columns, nothing in them."""
    return dict.fromkeys(SCHEMA.names)


def shard_of(rows: Sequence[Mapping[str, Any]], about: Mapping[str, Any]) -> bytes:
    """The Parquet file of some rows. The same rows give the same bytes, with the same version of pyarrow."""
    columns = [pa.array([row[field.name] for row in rows], field.type) for field in SCHEMA]
    metadata = {METADATA_KEY: json.dumps(about, sort_keys=True).encode()}
    table = pa.Table.from_arrays(columns, schema=SCHEMA.with_metadata(metadata))
    split = [f"{field.name}.list.element" for field in SCHEMA if field.type == _FLOATS]
    others = [f"{field.name}.list.element" if pa.types.is_list(field.type) else field.name for field in SCHEMA]
    buffer = io.BytesIO()
    pq.write_table(
        table,
        buffer,
        compression="zstd",
        compression_level=COMPRESSION_LEVEL,
        use_dictionary=[name for name in others if name not in split],
        use_byte_stream_split=split,
        write_statistics=False,
        write_page_checksum=True,
    )
    return buffer.getvalue()
