# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid diagnose`: its options, what it prints, and what it writes."""
