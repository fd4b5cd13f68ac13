# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Damaged files by the thousand: mutants of every format, and the one property they have.

`make test` tries 100 of a kind and `make test-fast` 50, always the same; `make fuzz` 10,000 other
ones. What fails is kept in tests/fuzz/failures, and is what the next `make fuzz` tries first.

"""
