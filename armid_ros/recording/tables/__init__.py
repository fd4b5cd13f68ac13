# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read recordings from tables: CSV, NPZ, MAT, Parquet and LeRobot datasets. A plug-in."""

from armid_ros.recording.tables.files import is_table, open_table
from armid_ros.recording.tables.plan import converted, plan, TablePlan
from armid_ros.recording.tables.table import side_by_side, Table, TableColumn

__all__ = [
    'TableColumn',
    'TablePlan',
    'Table',
    'converted',
    'is_table',
    'open_table',
    'plan',
    'side_by_side',
]
