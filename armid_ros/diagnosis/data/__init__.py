# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From recordings to weighted rows: filters, noise, and the unit of the gap."""
