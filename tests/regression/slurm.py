"""Slurm on this machine, for a test: munged, slurmctld and slurmd with a configuration of their own in a folder, stopped by their pid
files. Needs root and the packages slurm-wlm and munge."""
import contextlib
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "scancel"]


def missing():
    """Why there can be no Slurm here; empty: there can."""
    absent = [p for p in PROGRAMS if not shutil.which(p, path=os.environ["PATH"] + ":/usr/sbin:/sbin")]
    if absent:
        return f"not installed: {', '.join(absent)} (Debian: slurm-wlm, munge)"
    return "" if os.geteuid() == 0 else "not root"


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def configuration(folder):
    host = socket.gethostname().split(".")[0]
    return f"""ClusterName=flexframe
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
MpiDefault=none
ReturnToService=2
KillWait=2
MinJobAge=600
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=short Nodes={host} Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
"""


def wait_for(condition, what, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError(f"Slurm: {what} did not come in {seconds:g} s")
        time.sleep(0.1)


class Slurm:
    def __init__(self, folder):
        self.folder = folder
        self.environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"), PATH=os.environ["PATH"] + ":/usr/sbin:/sbin")
        self.host = socket.gethostname().split(".")[0]

    def run(self, *words, check=True):
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, env=self.environment, timeout=60)
        if check and done.returncode != 0:
            raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr.strip()}")
        return done.stdout

    def jobs(self, state=None):
        """Jobs that are not done: [(number, state)], a line each task of an array."""
        text = self.run("squeue", "--noheader", "--array", "--format=%i %T")
        jobs = [tuple(line.split()) for line in text.splitlines()]
        return [j for j in jobs if state is None or j[1] == state]

    def wait_until_idle(self, seconds=300.0):
        wait_for(lambda: not self.jobs(), "the end of all jobs", seconds)

    def drain(self):
        self.run("scontrol", "update", f"nodename={self.host}", "state=drain", "reason=test")

    def resume(self):
        self.run("scontrol", "update", f"nodename={self.host}", "state=resume")


def stop(pid_file):
    try:
        pid = int(pid_file.read_text())
        os.kill(pid, signal.SIGTERM)
        for _ in range(100):
            os.kill(pid, 0)
            time.sleep(0.05)
        os.kill(pid, signal.SIGKILL)
    except (OSError, ValueError):
        pass


@contextlib.contextmanager
def running(folder):
    """Slurm in this folder; all that was started is stopped at the end."""
    folder = pathlib.Path(folder).resolve()
    for name in ["", "state", "spool"]:
        (folder / name).mkdir(parents=True, exist_ok=True)
    folder.chmod(0o755)
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o400)
    (folder / "slurm.conf").write_text(configuration(folder))
    (folder / "cgroup.conf").write_text("CgroupPlugin=autodetect\n")
    slurm = Slurm(folder)
    try:
        slurm.run(
            "munged",
            "--force",
            f"--socket={folder}/munge.socket",
            f"--key-file={folder}/munge.key",
            f"--pid-file={folder}/munged.pid",
            f"--log-file={folder}/munged.log",
            f"--seed-file={folder}/munge.seed",
        )
        slurm.run("slurmctld", "-c")
        slurm.run("slurmd", "-c")
        wait_for(lambda: "idle" in slurm.run("sinfo", "--noheader", "--format=%T", check=False), "an idle node")
        yield slurm
    finally:
        with contextlib.suppress(Exception):
            slurm.run("scancel", "--user=root", check=False)
        for name in ["slurmd", "slurmctld", "munged"]:
            stop(folder / f"{name}.pid")
