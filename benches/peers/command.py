"""Runs of bondline's command: sweeps of one case."""

import json
import os
import pathlib
import resource
import shutil
import subprocess
import time

import numpy as np
import pyarrow.parquet as parquet

ROOT = pathlib.Path(__file__).parents[2]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")


class Command:
    def __init__(self, case, folder):
        self.case, self.folder = case, folder

    def plan(self, sets, path):
        """Write the plan of the case at a resolution."""
        ours = ["cargo", "bench", "--quiet", "--bench", "plan", "--", self.case, *sets]
        path.write_bytes(subprocess.run(ours, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)
        return path

    def sweep(self, members, sets, keep=None):
        """March so many members: the summary, with the time of the whole process and its processor time, s."""
        out = self.folder / "sweep"
        shutil.rmtree(out, ignore_errors=True)
        ours = [
            TARGET / "release/bondline",
            "uncertainty",
            ROOT / "cases" / self.case,
            "-n",
            str(members),
            "--out",
            out,
            "--json",
            "--quiet",
        ]
        ours += [
            "--backend",
            "cpu",
            *(["--keep", keep] if keep else []),
            *(part for each in sets for part in ("--set", each)),
        ]
        began, busy_s = time.perf_counter(), processor_s()
        summary = subprocess.run(ours, check=True, capture_output=True, text=True).stdout
        wall_s = time.perf_counter() - began
        return json.loads(summary) | {"process_s": wall_s, "processor_s": processor_s() - busy_s}

    def traces(self, members, sets):
        """Member × instant × sensor, K, and the summary."""
        summary = self.sweep(members, sets, "traces")
        table = parquet.read_table(self.folder / "sweep/traces.parquet")
        shown = np.stack([table[f"{sensor}_k"].to_numpy() for sensor in summary["sensors"]], axis=-1)
        return shown.reshape(members, -1, shown.shape[-1]), summary

    def columns(self, members, factors, sets):
        """A row a member as the command draws it: one, then its factors."""
        self.sweep(members, sets, "members")
        table = parquet.read_table(self.folder / "sweep/members.parquet")
        return np.column_stack([np.ones(members), *(table[factor].to_numpy() for factor in factors)])


def processor_s():
    """Processor time of all completed commands."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
