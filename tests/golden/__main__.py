# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Write the stored results anew: `python -m tests.golden [NAME ...]`; all of them without a name.

Results of recordings that are absent stay. `git diff tests/golden` shows what has changed.

"""

from __future__ import annotations

import json
from pathlib import Path
import sys
import tempfile
import time

from tests.golden.cases import answer, CASES, DATA, LIVED, lived_answer, RESULTS
from tests.golden.inputs import lay_out


def main(names: list[str]) -> None:
    """Run the cases of these names, `lived` among them, and write a file for each."""
    wanted = names or [*CASES, 'lived']
    with tempfile.TemporaryDirectory() as folder:
        inputs = Path(folder, 'inputs')
        inputs.mkdir()
        lay_out(inputs)
        for name in wanted:
            begin = time.process_time()
            if name == 'lived':
                _write(name, {f'{kind}/{n}': lived_answer(kind, n) for kind, n in LIVED})
            elif CASES[name].real and not DATA.is_dir():
                print(f'{name}: ARMID_DATA names no folder; the stored result stays')
                continue
            else:
                out = Path(folder, name)
                out.mkdir()
                _write(name, answer(name, inputs, out))
            print(f'{name}: {time.process_time() - begin:.1f} s of processor time', flush=True)


def _write(name: str, result: object) -> None:
    text = json.dumps(result, indent=1, sort_keys=True)
    (RESULTS / f'{name}.json').write_text(text + '\n', encoding='utf-8')


if __name__ == '__main__':
    main(sys.argv[1:])
