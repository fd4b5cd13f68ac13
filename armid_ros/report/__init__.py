# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reports and figures: what was found, for a person to read and to believe.

``armid_ros.report.figures`` draws figures for documents.

"""
