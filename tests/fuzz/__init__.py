# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Damaged files by the thousand: mutants of every format, and the one property they have.

`make test` tries 300 of a kind, always the same; `make fuzz` 10,000 other ones, and keeps what
fails in tests/fuzz/failures, from where it is tried first ever after.

"""
