# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Published methods and machines, one plug-in per paper; other modules do not import them."""
