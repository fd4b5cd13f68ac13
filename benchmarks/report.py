# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How large report.html is, and how long a browser takes until all of it is drawn.

Of ten minutes of a 7-joint arm at 1 kHz, fitted among bodies, with a held-out recording, every
fold of the page open; the time is from the request of the file to the frame after the last chart.

"""

import argparse
from pathlib import Path
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.arm.export import arm_mjcf, arm_urdf
from armid_ros.identification import (
    IdentificationSettings,
    identify,
    PhysicalSettings,
    SignalSettings,
    verify,
)
from armid_ros.recording import Recording
from armid_ros.report import identification_report, Provenance, versions
from armid_ros.report.identification_report import Assessment
import numpy as np

from benchmarks.browser import Browser, BROWSERS, find_browser
from benchmarks.offline_speed import CUTOFF_HZ, DECIMATION, motion, panda

SIZE_MB, DRAWN_S = 5.0, 2.0
OPEN = 'document.querySelectorAll("details").forEach(fold => { fold.open = true; })'
DRAWN = (
    'new Promise(done => requestAnimationFrame(() => requestAnimationFrame('
    '() => done(performance.now()))))'
)


def recorded(arm, minutes, source, rng):
    """Return what sensors of some noise would record of an arm."""
    exact = motion(arm, minutes, rng)
    return Recording(
        joints=exact.joints,
        t=exact.t,
        q=exact.q + 1e-6 * rng.normal(size=exact.q.shape),
        tau=exact.tau + 0.05 * rng.normal(size=exact.tau.shape),
        source=source,
    )


def report(minutes):
    """Return the page, and the processor time that it took."""
    arm, rng = panda(), np.random.default_rng(0)
    recordings = [recorded(arm, minutes, 'training', rng)]
    held_out = [recorded(arm, 1.0, 'held out', rng)]
    settings = IdentificationSettings(
        signals=SignalSettings(CUTOFF_HZ, DECIMATION), physical=PhysicalSettings()
    )
    description = ArmModel(arm.robot, arm.effects)
    seconds = [time.process_time()]
    result = identify(description, recordings, settings, rng=rng)
    seconds.append(time.process_time())
    verification = verify(result, description, recordings, held_out, rng=rng)
    seconds.append(time.process_time())
    exports = {
        'identified.urdf': arm_urdf(result.arm),
        'identified.mjcf.xml': arm_mjcf(result.arm),
    }
    page = identification_report(
        result,
        description=description,
        robot='panda',
        recordings=recordings,
        validation={'held out': result.predict(held_out)},
        validation_recordings=held_out,
        assessment=Assessment(
            verification,
            exports={name: made.without_place for name, made in exports.items()},
        ),
        provenance=Provenance(versions=versions(), seed=0),
    )
    seconds.append(time.process_time())
    return page, np.diff(seconds)


def main():
    """Print size and times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument('--repeats', type=int, default=5)
    arguments = parser.parse_args()
    page, (identified, verified, written) = report(arguments.minutes)
    print(
        f'{arguments.minutes:g} min of 7 joints at 1 kHz, processor time: identified '
        f'{identified:.1f} s, verified {verified:.1f} s, report {written:.1f} s'
    )
    size = len(page.encode()) / 1e6
    print(f'report.html  {size:.2f} MB, wanted below {SIZE_MB:g} MB')
    command = find_browser()
    if command is None:
        print(f'no browser to draw it: none of {", ".join(BROWSERS)}')
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'report.html'
        path.write_text(page, encoding='utf-8')
        browser = Browser(command, Path(folder) / 'profile')
        for what, width in (('desktop', 1200), ('phone', 390)):
            times = []
            for _ in range(arguments.repeats):
                browser.open(path, width)
                browser.run(OPEN)
                times.append(browser.run(DRAWN) / 1e3)
            print(
                f'drawn at {width} px ({what})  {np.median(times):.2f} s, slowest of '
                f'{len(times)} {max(times):.2f} s, wanted below {DRAWN_S:g} s'
            )
        browser.close()


if __name__ == '__main__':
    main()
