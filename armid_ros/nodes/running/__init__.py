# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run nodes as processes: arguments, domains, launch files and real time."""
