# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of rates is that of the recorded results, and fits on one screen."""

from benchmarks.looks import LOG
from benchmarks.rates import PAGE, page, PUBLIC, PUBLIC_PAGE, public_page, RATES


def test_the_page_is_up_to_date_and_short():
    made = page(LOG.read_text(encoding='utf-8'), RATES.read_text(encoding='utf-8'))
    assert PAGE.read_text(encoding='utf-8') == made  # `python -m benchmarks.rates` writes it
    assert len(made.splitlines()) <= 80


def test_the_page_of_the_public_benchmark_is_up_to_date():
    made = public_page(PUBLIC.read_text(encoding='utf-8'))
    assert PUBLIC_PAGE.read_text(encoding='utf-8') == made
