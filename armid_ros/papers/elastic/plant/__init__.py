# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated arm whose motors drive its links through springs."""
