# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Elastic joints, as in the paper on the two-link arm: identification and report."""
