# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pages and the package use the words of the glossary: counts of others may only fall."""

from collections import Counter
from functools import cache
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
#: Largest count in the package; a commit that lowers a count lowers it here.
CEILING = {
    'told': 129,
    'said': 288,
    'says': 157,
    'tells': 69,
    'asks': 21,
    'asked': 224,
    'believes': 3,
    'believed': 66,
    'denies': 1,
    'denied': 11,
    'beside': 178,
    'knows': 28,
    'heard': 14,
}
#: Count in the pages: one quotes a message of the package.
IN_PAGES = {'beside': 1}


@cache
def counts(*folders):
    """Return how often each word occurs in the files of folders."""
    files = [path for folder, ending in folders for path in (ROOT / folder).rglob(ending)]
    words = Counter()
    for path in files:
        words.update(re.findall(r'\w+', path.read_text(encoding='utf-8')))
    return words


@pytest.mark.parametrize('word', CEILING)
def test_a_word_of_dialect_becomes_no_more_frequent(word):
    use = f'{word}: docs/reference/glossary.md has the words to use'
    assert counts(('armid_ros', '*.py'))[word] <= CEILING[word], use
    assert counts(('docs', '*.md'))[word] <= IN_PAGES.get(word, 0), use


def test_the_glossary_stays_short():
    text = (ROOT / 'docs' / 'reference' / 'glossary.md').read_text(encoding='utf-8')
    assert len(re.findall(r'^: {3}', text, re.MULTILINE)) <= 45
