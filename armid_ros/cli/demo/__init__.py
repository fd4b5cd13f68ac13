# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid demo`: excite, identify and diagnose a simulated arm."""
