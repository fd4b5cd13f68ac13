# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The weighted rows and what free columns leave of them."""

from types import SimpleNamespace

from armid_ros.diagnosis.data.trajectory import block_rows
import numpy as np
import pytest


@pytest.mark.parametrize('rows', [1, 2, 7, 13, 60, 200])
def test_every_block_has_rows(rows):
    """A short stretch makes folds of a row or two."""
    parts = [SimpleNamespace(fold=k, rows=np.arange(count)) for k, count in enumerate((rows, 90))]
    block, fold = block_rows(parts)
    assert np.all(np.bincount(block, minlength=len(fold)) > 0)
    assert len(block) == rows + 90
