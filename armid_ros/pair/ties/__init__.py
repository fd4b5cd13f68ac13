# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ties to a machine that was recorded beside the arm.

`diagnose_beside` is the diagnosis of an arm that may be tied to one.

"""
