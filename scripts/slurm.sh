#!/usr/bin/env bash
# A Slurm job array on this machine: two tasks are killed, and one is requeued while its first attempt lives. What
# `merge --missing` lists is submitted again, and the merged sweep must equal that of one process.
# Needs: Linux, root, the packages slurmctld, slurmd, slurm-client and munge (Debian, Ubuntu), python3, and bondline:
#   scripts/slurm.sh [PATH_OF_BONDLINE]    default: that of `cargo build --profile work`
# Daemons of its own listen on the loopback interface and end with the script; those of the system are not touched.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/slurm.sh: %s\n' "$*" >&2; exit 1; }
say() { printf '== %s\n' "$*"; }

bondline=$(realpath "${1:-${CARGO_TARGET_DIR:-target}/work/bondline}")
[ -x "$bondline" ] || fail "$bondline not found: cargo build --profile work --bin bondline"
[ "$(id -u)" -eq 0 ] || fail 'needs root: slurmd starts the processes of its tasks as their users'
for program in munged slurmctld slurmd sbatch squeue scontrol python3; do
    command -v "$program" >/dev/null ||
        fail "$program not found: apt-get install slurmctld slurmd slurm-client munge python3"
done

members=${BONDLINE_SLURM_MEMBERS:-600000}
pieces=8
root=$(mktemp -d /tmp/bondline-slurm.XXXXXX)
daemons=()
stop() {
    local pid
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
    # A process that stands still, or that outlived its task, would be left behind.
    pkill -KILL -f "uncertainty .* --out $root/pieces" || true
    wait 2>/dev/null || true
    rm -rf "$root"
}
trap stop EXIT
mkdir "$root"/{state,spool,log}
host=$(hostname -s)

cat >"$root/slurm.conf" <<CONF
ClusterName=bondline
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
AuthType=auth/munge
# A requeued task may start once the credential of its first attempt has expired.
AuthInfo=socket=$root/munge.socket,cred_expire=5
SlurmUser=root
StateSaveLocation=$root/state
SlurmdSpoolDir=$root/spool
SlurmctldPidFile=$root/slurmctld.pid
SlurmdPidFile=$root/slurmd.pid
# Only the group of the batch script is killed, so that a process of a requeued task can outlive it.
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=2
MinJobAge=3600
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=local Nodes=$host Default=YES State=UP MaxTime=INFINITE
CONF
export SLURM_CONF=$root/slurm.conf

dd if=/dev/urandom of="$root/munge.key" bs=1024 count=1 status=none
chmod 600 "$root/munge.key"
munged --foreground --force --socket="$root/munge.socket" --key-file="$root/munge.key" --pid-file="$root/munged.pid" \
    --log-file="$root/log/munged" --seed-file="$root/munge.seed" 2>"$root/log/munged.error" & daemons+=($!)
slurmctld -D >"$root/log/slurmctld" 2>&1 & daemons+=($!)
slurmd -D -N "$host" >"$root/log/slurmd" 2>&1 & daemons+=($!)

# Wait until a command succeeds.
await() {
    local second
    for ((second = 0; second < ${seconds:-120}; second++)); do
        "$@" >/dev/null 2>&1 && return 0
        sleep 1
    done
    tail -n 20 "$root"/log/* >&2
    fail "no success within ${seconds:-120} s: $*"
}
await eval 'sinfo -h -o %t | grep -q idle'
say "$(sinfo --version) on 127.0.0.1: $(sinfo -h -o '%D node, %C processors (allocated/idle/other/all)')"

cat >"$root/sweep.sh" <<BATCH
#!/bin/bash
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --output=$root/log/task-%a-%A
#SBATCH --open-mode=append
export RAYON_NUM_THREADS=\$SLURM_CPUS_PER_TASK
# A session of its own, as a process has that a node which lost its network runs on.
setsid $bondline uncertainty cases/lamp-test -n $members --piece $pieces --backend cpu --out $root/pieces --quiet &
echo \$! >$root/process-\$SLURM_ARRAY_TASK_ID-\${SLURM_RESTART_COUNT:-0}
wait \$!
BATCH

# The process of an attempt of a task.
process() { cat "$root/process-$1-$2"; }
starts() { seconds=300 await test -s "$root/process-$1-$2"; }
ended() { ! kill -0 "$1"; }
array_ended() { [ -z "$(squeue -h -j "$1" 2>/dev/null)" ]; }

job=$(sbatch --parsable --array="1-$pieces" "$root/sweep.sh")
say "job $job: $pieces pieces of a sweep of $members members"
for task in 1 3; do
    starts "$task" 0
    sleep 1
    kill -KILL "$(process "$task" 0)"
    say "task $task killed"
done
starts 4 0
first=$(process 4 0)
# It stands still until the second attempt has ended, and is alive.
kill -STOP "$first"
scontrol requeue "${job}_4"
starts 4 1
second=$(process 4 1)
await ended "$second"
kill -0 "$first" || fail 'the first attempt of task 4 died with its requeue'
grep -q "process $first" "$root"/log/task-4-* || {
    cat "$root"/log/task-4-* >&2
    fail "the second attempt of task 4 does not name process $first"
}
say "task 4 requeued while its first attempt, process $first, lived: $(grep "process $first" "$root"/log/task-4-*)"
kill -CONT "$first"
seconds=600 await array_ended "$job"
seconds=600 await ended "$first"

if "$bondline" merge "$root/pieces" --out "$root/early" 2>"$root/log/early"; then
    fail 'a sweep without two of its pieces was merged'
fi
missing=$("$bondline" merge --missing "$root/pieces" 2>/dev/null) && fail 'no piece is missing'
say "$missing"
[ "$missing" = "missing: --array=1,3 of $pieces pieces" ] || fail 'expected tasks 1 and 3 to be missing'
again=$(sbatch --parsable --array=1,3 "$root/sweep.sh")
seconds=600 await array_ended "$again"
"$bondline" merge "$root/pieces" --out "$root/merged" >/dev/null
"$bondline" uncertainty cases/lamp-test -n "$members" --backend cpu --out "$root/whole" --quiet >/dev/null
python3 - "$root" <<'PYTHON'
import json, pathlib, sys

root = pathlib.Path(sys.argv[1])
# The question, when, where and from which files.
varying = {"command", "seconds", "backend", "provenance", "checksum"}


def numbers(folder):
    summary = json.loads((root / folder / "summary.json").read_text())
    assert varying <= summary.keys()
    return {key: value for key, value in summary.items() if key not in varying}


assert numbers("merged") == numbers("whole"), "the merged summary differs from that of one process"
for table in ("percentiles.csv", "shares.csv", "traces.csv"):
    assert (root / "merged" / table).read_bytes() == (root / "whole" / table).read_bytes(), table
PYTHON
say "the merged sweep has the summary and the tables of one process"
