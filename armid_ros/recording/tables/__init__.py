# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read recordings from tables: CSV, NPZ, MAT, Parquet, LeRobot datasets."""

from armid_ros.recording.tables.files import is_table, open_table
from armid_ros.recording.tables.measured import measured
from armid_ros.recording.tables.plan import plan, TablePlan
from armid_ros.recording.tables.settings import (
    ColumnSettings,
    in_si,
    name_in_file,
    numbers,
    per_joint,
    refuse_columns,
    renamed,
)
from armid_ros.recording.tables.table import side_by_side, Table, TableColumn

__all__ = [
    'TableColumn',
    'ColumnSettings',
    'TablePlan',
    'Table',
    'in_si',
    'is_table',
    'measured',
    'name_in_file',
    'numbers',
    'open_table',
    'per_joint',
    'plan',
    'refuse_columns',
    'renamed',
    'side_by_side',
]
