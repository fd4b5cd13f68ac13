# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read MCAP files with or without index, and write them so that a kill loses little."""
