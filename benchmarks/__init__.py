# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks of speed and accuracy, with other libraries on the same data."""
