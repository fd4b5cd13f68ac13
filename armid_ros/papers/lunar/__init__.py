# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The humanoid arm of the lunar paper: its experiments repeated, its figures beside ours."""
