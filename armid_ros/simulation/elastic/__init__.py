# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms whose motors drive their links through springs: made, driven and recorded."""
