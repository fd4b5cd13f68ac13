# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read recordings from tables: CSV, NPZ, MAT, Parquet, LeRobot datasets; a plug-in."""

from armid_ros.recording.tables.files import is_table, open_table
from armid_ros.recording.tables.plan import measured, plan, TablePlan
from armid_ros.recording.tables.table import side_by_side, Table, TableColumn

__all__ = [
    'TableColumn',
    'TablePlan',
    'Table',
    'is_table',
    'measured',
    'open_table',
    'plan',
    'side_by_side',
]
