# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
HTML reports of results, each a single file.

Every report is a `page.Page` of `page.Section`s, made by a module `*_report`.

"""
