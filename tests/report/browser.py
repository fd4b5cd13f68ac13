# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, in which reports are tested."""

import fcntl
import itertools
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys

BROWSERS = ('chromium', 'chromium-browser', 'google-chrome', 'chrome-headless-shell')
FLAGS = (
    '--headless',
    '--no-sandbox',
    '--disable-gpu',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--remote-debugging-pipe',
)
#: Chromium reads requests from descriptor 3 and writes answers to descriptor 4.
START = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.dup2(int(sys.argv[2]), 4)
os.execv(sys.argv[3], sys.argv[3:])
"""


def find_browser():
    """Return the command of a Chromium; None if none is installed."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


class Browser:
    """One page of a Chromium, over the pipe of its DevTools protocol."""

    def __init__(self, command, profile):
        requests, self._requests = os.pipe()
        self._answers, answers = os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (requests, answers)]
        start = [sys.executable, '-c', START, *map(str, ends)]
        self._process = subprocess.Popen(
            [*start, command, *FLAGS, f'--user-data-dir={profile}', 'about:blank'],
            pass_fds=ends,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for end in (requests, answers, *ends):
            os.close(end)
        self._stream = os.fdopen(self._answers, 'rb')
        self._numbers = itertools.count(1)
        self._rest = b''
        self._session = None
        self.complaints = []
        self.requested = []
        page = self.call('Target.createTarget', url='about:blank')['targetId']
        self._session = self.call('Target.attachToTarget', targetId=page, flatten=True)[
            'sessionId'
        ]
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')

    def call(self, method, **parameters):
        """Send a command and return its result; events in between are recorded."""
        number = next(self._numbers)
        message = {'id': number, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        os.write(self._requests, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._read()
            if answer.get('id') == number:
                assert 'error' not in answer, answer
                return answer['result']
            self._notice(answer)

    def open(self, path, width, height=900, dark=False):
        """Load a file in a window of a given width; return when page and scripts are complete."""
        self.complaints.clear()
        self.requested.clear()
        self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
        self.call('Emulation.setEmulatedMedia', features=[scheme])
        self.call('Page.navigate', url=Path(path).resolve().as_uri())
        self.run(
            'new Promise(done => document.readyState === "complete" ? done() '
            ': addEventListener("load", done))'
        )

    def run(self, script):
        """Evaluate JavaScript in the page and return its value."""
        answer = self.call(
            'Runtime.evaluate', expression=script, awaitPromise=True, returnByValue=True
        )
        assert 'exceptionDetails' not in answer, answer['exceptionDetails']
        return answer['result'].get('value')

    def close(self):
        """End the browser."""
        self._process.terminate()
        self._process.wait()
        os.close(self._requests)
        self._stream.close()

    def _read(self):
        while b'\0' not in self._rest:
            block = self._stream.read1()
            assert block, 'the browser has ended'
            self._rest += block
        message, _, self._rest = self._rest.partition(b'\0')
        return json.loads(message)

    def _notice(self, event):
        method, what = event.get('method'), event.get('params', {})
        if method == 'Runtime.exceptionThrown':
            self.complaints.append(what['exceptionDetails'])
        elif method == 'Runtime.consoleAPICalled' and what['type'] in ('error', 'warning'):
            self.complaints.append(what['args'])
        elif method == 'Log.entryAdded':
            self.complaints.append(what['entry'])
        elif method == 'Network.requestWillBeSent':
            self.requested.append(what['request']['url'])
