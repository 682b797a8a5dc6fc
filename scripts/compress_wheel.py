#!/usr/bin/env python3
"""Compress the files of a wheel again by Zopfli, which every unpacker of ZIP archives reads: 3 % smaller.

    scripts/compress_wheel.py WHEEL
"""

import os
import sys
from zipfile import ZIP_DEFLATED

from zopfli import ZipFile

if len(sys.argv) != 2:
    sys.exit(__doc__)
wheel = sys.argv[1]
smaller = wheel + ".smaller"
with ZipFile(wheel) as given, ZipFile(smaller, "w", ZIP_DEFLATED) as written:
    for entry in given.infolist():
        written.writestr(entry, given.read(entry))
os.replace(smaller, wheel)
