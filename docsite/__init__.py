# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Generators of the documentation site from docs/ and from the code: `make docs`."""
