# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is shown of a tied pair of machines."""
