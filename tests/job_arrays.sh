#!/usr/bin/env bash
# The job scripts of the guide `sweeps`, run by a Slurm and a HyperQueue of their own on this machine: the
# sweep of 24 cases must give the bytes of `--jobs 2`. Usage: tests/job_arrays.sh PATH/TO/moreau2d
#
# Needs slurmctld, slurmd, sbatch and munged (Debian: slurm-wlm, munge), and python3 with the wheel
# `hyperqueue`. What is missing is said and skipped. Ends with 0 if all that ran is right, with 77 if nothing ran.
set -euo pipefail
program=$(realpath "$1")
root=$(realpath "$(dirname "$0")/..")
work=$(mktemp -d)
daemons=()
stop() {
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
    for pid in "${daemons[@]}"; do wait "$pid" 2>/dev/null || true; done
    rm -rf "$work"
}
trap stop EXIT
PATH=$(dirname "$program"):$PATH:/usr/sbin
ran=0

# expected: the sweep by one process
mkdir "$work/alone"
cp "$root/scenes/sweeps/sliding-block.toml" "$work/alone/plan.toml"
(cd "$work/alone" && moreau2d sweep plan.toml --jobs 2 --out cases --quiet &&
    moreau2d merge cases --out table --quiet)

# missing PROGRAM...: says which of them are not there
missing() {
    local name gone=()
    for name in "$@"; do command -v "$name" >/dev/null || gone+=("$name"); done
    [ ${#gone[@]} -eq 0 ] && return 1
    echo "skipped: no ${gone[*]}"
}

# until_true COMMAND...: waits until it succeeds, for a minute at most
until_true() {
    for _ in $(seq 300); do "$@" >/dev/null 2>&1 && return; sleep 0.2; done
    echo "still not true after a minute: $*"
    return 1
}

# same NAME: the folder NAME has the bytes of the sweep by one process
same() {
    (cd "$work/$1" && moreau2d merge cases --out table --quiet)
    diff -r "$work/alone/cases" "$work/$1/cases"
    diff -r "$work/alone/table" "$work/$1/table"
    [ "$(find "$work/$1/cases" -name case.json | wc -l)" -eq 24 ]
    echo "$1: 24 cases, the bytes of --jobs 2"
    ran=$((ran + 1))
}

slurm() {
    local conf=$work/slurm.conf user host
    user=$(id -un)
    host=$(hostname -s)
    mkdir "$work/slurm" "$work/state" "$work/spool" "$work/munge"
    chmod 0711 "$work"
    chmod 0755 "$work/munge"
    head -c 1024 /dev/urandom >"$work/munge.key"
    chmod 0600 "$work/munge.key"
    munged --foreground --force --key-file="$work/munge.key" --socket="$work/munge/socket" \
        --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed" 2>"$work/munge/err" &
    daemons+=($!)
    until_true test -S "$work/munge/socket"
    cat >"$conf" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$conf
    slurmctld -D -f "$conf" 2>/dev/null &
    daemons+=($!)
    slurmd -D -f "$conf" 2>/dev/null &
    daemons+=($!)
    until_true sh -c 'sinfo -h -o %t | grep -q idle'
    cp "$work/alone/plan.toml" "$root/src/guide/sweeps/slurm_job.sh" "$work/slurm"
    (cd "$work/slurm" && timeout 300 sbatch --wait slurm_job.sh) || {
        cat "$work"/slurm*.log "$work"/slurm/slurm-*.out
        exit 1
    }
    same slurm
}

hyperqueue() {
    mkdir "$work/hyperqueue"
    cp "$work/alone/plan.toml" "$work/hyperqueue"
    (cd "$work/hyperqueue" && timeout 300 python3 "$root/src/guide/sweeps/hq_job.py" >log 2>&1) || {
        cat "$work"/hyperqueue/log "$work"/hyperqueue/*.stderr
        exit 1
    }
    same hyperqueue
}

echo "== Slurm"
missing munged slurmctld slurmd sbatch sinfo || slurm
echo "== HyperQueue"
if python3 -c 'import hyperqueue' 2>/dev/null; then
    hyperqueue
else
    echo "skipped: no python3 with the module hyperqueue"
fi
[ "$ran" -gt 0 ] || exit 77
