"""A real Slurm of one node on this machine, for one test: controller, node and munge in a folder of their own.

Needs the packages slurmctld, slurmd, slurm-client, munge, installed or unpacked: SURGEBREAK_SLURM names a folder that
`dpkg -x` filled with these and slurm-wlm-basic-plugins. No systemd, no accounting,
no cgroups: proctrack/linuxproc, task/none. As root only (munge and the node's daemon ask for it).
"""

import contextlib
import os
import shutil
import socket
import subprocess
from pathlib import Path

from .until import until

CONF = """\
ClusterName=here
SlurmctldHost={host}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock
CredType=cred/munge
SlurmctldPort={port}
SlurmdPort={next_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,sched_min_interval=0
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
KillWait=20
MinJobAge=5
OverTimeLimit=0
JobRequeue=1
SlurmdParameters=config_overrides
{plugins}
NodeName={host} CPUs={cpus} RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


class Slurm:
    """A context; `variables` are those with which sbatch, squeue and the like find it."""

    def __init__(self, folder: Path, cpus: int = 2):
        self.folder, self.cpus = Path(folder), cpus
        self.root = Path(os.environ.get("SURGEBREAK_SLURM", "/"))
        self.daemons: list[subprocess.Popen] = []
        path = [str(self.root / part) for part in ("usr/bin", "usr/sbin")]
        libraries = self.root / "usr/lib/x86_64-linux-gnu/slurm-wlm"
        self.plugins = libraries
        self.variables = {
            "PATH": os.pathsep.join([str(self.folder / "bin"), *path, os.environ["PATH"]]),
            "SLURM_CONF": str(self.folder / "slurm.conf"),
            "LD_LIBRARY_PATH": os.pathsep.join([str(libraries), str(self.root / "usr/lib/x86_64-linux-gnu")]),
        }

    @staticmethod
    def missing() -> str:
        """Why there can be none here; empty where there can."""
        if os.getuid() != 0:
            return "not root"
        slurm = Slurm(Path("/nowhere"))
        names = ("slurmctld", "slurmd", "munged", "sbatch", "mungekey")
        absent = [name for name in names if slurm.program(name) is None]
        return (
            f"no {', '.join(absent)}; apt-get install slurmctld slurmd slurm-client munge" if absent else ""
        )

    def program(self, name: str) -> str | None:
        """The daemon or command of that name; Debian's alternatives are not there in what dpkg -x unpacked."""
        path = self.variables["PATH"]
        return shutil.which(name, path=path) or shutil.which(f"{name}-wlm", path=path)

    def __enter__(self) -> "Slurm":
        for name in ("state", "spool", "bin", "munge"):
            (self.folder / name).mkdir(parents=True)
        os.chmod(self.folder / "munge", 0o755)
        for name in ("slurmstepd",):  # slurmd looks for it beside its own kind
            found = self.program(name)
            if found is not None:
                (self.folder / "bin" / name).symlink_to(found)
        host = socket.gethostname()
        with contextlib.closing(socket.socket()) as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        plugins = f"PluginDir={self.plugins}"
        text = CONF.format(
            host=host, folder=self.folder, port=port, next_port=port + 1, cpus=self.cpus, plugins=plugins
        )
        (self.folder / "slurm.conf").write_text(text, encoding="utf-8")
        key, munge = self.folder / "munge" / "key", self.folder / "munge.sock"
        self._run("mungekey", "--create", f"--keyfile={key}")
        os.chmod(self.folder, 0o755)
        logs = self.folder / "munge"
        self._daemon(
            "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={munge}", f"--pid-file={logs}/pid",
            f"--log-file={logs}/log", f"--seed-file={logs}/seed", "--num-threads=2",
        )  # fmt: skip
        until(munge.exists, "a socket of munged", report=self._logs)
        self._daemon("slurmctld", "-D")
        self._daemon("slurmd", "-D", "-d", str(self.folder / "bin" / "slurmstepd"))
        until(
            lambda: "idle" in self.output_of("sinfo", "-h", "-o", "%T"),
            "an idle node",
            every=0.5,
            report=self._logs,
        )
        return self

    def _daemon(self, name: str, *words: str) -> None:
        with (self.folder / f"{name}.out").open("w") as log:
            self.daemons.append(
                subprocess.Popen(
                    [self.program(name), *words], stdout=log, stderr=log, env=os.environ | self.variables
                )
            )

    def _run(self, name: str, *words: str) -> None:
        subprocess.run([self.program(name), *words], check=True, env=os.environ | self.variables)

    def _logs(self) -> str:
        return "\n".join(p.read_text(errors="replace")[-2000:] for p in sorted(self.folder.glob("*.log")))

    def queue(self) -> list[str]:
        """Numbers of the jobs that wait or run."""
        return self.output_of("squeue", "-h", "-r", "-o", "%i").split()

    def output_of(self, *words: str) -> str:
        """What a command of Slurm prints."""
        variables = os.environ | self.variables
        return subprocess.run(words, capture_output=True, text=True, check=False, env=variables).stdout

    def __exit__(self, *_) -> None:
        self.output_of("scancel", "--user=root")
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in self.daemons:
            with contextlib.suppress(subprocess.TimeoutExpired):
                daemon.wait(20)
            daemon.kill()
