# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid demo`: run every command once, and diagnose a hidden change."""
