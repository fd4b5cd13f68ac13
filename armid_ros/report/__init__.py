# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reports: what was found, for a person to read.

``identification_report`` makes report.html. A `Page` of `Section`s is the frame of every report;
`Chart` and `BarChart` draw in it.

"""

from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, Level, Series, thinned
from armid_ros.report.identification_report import identification_report
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import FileHash, hash_files, Provenance, versions

__all__ = [
    'Bar',
    'BarChart',
    'Chart',
    'FileHash',
    'Level',
    'Page',
    'Provenance',
    'Section',
    'Series',
    'hash_files',
    'identification_report',
    'thinned',
    'versions',
]
