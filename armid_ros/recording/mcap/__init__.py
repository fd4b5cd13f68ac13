# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read MCAP files with or without index, and write them with little loss after a kill."""
