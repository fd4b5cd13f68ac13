# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Published methods and machines, one plug-in per paper; no other module imports a plug-in."""
