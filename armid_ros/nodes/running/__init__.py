# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node as a process: threads, domains, clocks, and what it outlives."""
