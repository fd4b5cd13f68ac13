# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What ``import armid_ros`` offers, one job a file.

The packages below compute; here paths become robots and recordings, an integer becomes a random
generator, and results print themselves.

"""
