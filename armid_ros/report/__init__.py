# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reports of results, for a person to read.

A `page.Page` of `page.Section`s is the frame of every report; a module `*_report` makes each.

"""
