# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""MCAP files: written so that a kill costs nothing, read with and without their index."""
