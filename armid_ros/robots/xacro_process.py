# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Expands one xacro file, as a process of its own; started by `armid_ros.robots.xacro_expansion`.

A request comes on stdin and the answer goes to stdout, both in JSON. The process limits itself in
memory and processor time before it reads a line of the file.

"""

from __future__ import annotations

import json
import math
import os
import resource
import sys
from typing import Any


def main() -> None:
    """Answer one request."""
    request = json.load(sys.stdin)
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)  # what an expansion prints is no answer
    seconds, memory = math.ceil(request['seconds']), int(request['memory'])
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    json.dump(expanded(request), answers)
    answers.close()


def expanded(request: dict[str, Any]) -> dict[str, str]:
    """Return the text that a file expands to, or the error why it does not."""
    answer: dict[str, str] = {}
    try:
        import xacro

        document = xacro.process_file(request['path'], mappings=request['arguments'])
        answer['text'] = str(document.toxml())
        if len(answer['text']) > request['characters']:
            answer = {'error': f'it expands to {len(answer["text"])} characters'}
    except ImportError:
        answer['error'] = 'a xacro file needs the Python package xacro'
    except MemoryError:
        answer['error'] = 'takes too much memory'
    except RecursionError:
        answer['error'] = 'nested too deep'
    except SystemExit:
        answer['error'] = 'it cannot be expanded'
    except Exception as error:  # xacro evaluates Python expressions: anything can come out
        answer['error'] = ' '.join(str(error).split()) or type(error).__name__
    return answer


if __name__ == '__main__':
    main()
