"""A real Grid Engine of one node on this machine, for one test: master, node and queue in a folder of their own.

Needs the packages gridengine-master, gridengine-exec, gridengine-client, libjemalloc2 of Debian, installed (with
`SGE_START_MASTER=no`, or their own daemons stopped), or unpacked by `dpkg -x` into a folder that SURGEBREAK_SGE names;
the programs look for one library in /usr/lib/gridengine, which then is to be a link to that of the folder. As root.
"""

import contextlib
import os
import socket
import subprocess
from pathlib import Path

from .until import until

BOOTSTRAP = """\
admin_user              root
default_domain          none
ignore_fqdn             false
spooling_method         classic
spooling_lib            libspoolc
spooling_params         {cell}/default/common;{cell}/spool/qmaster
binary_path             {programs}
qmaster_spool_dir       {cell}/spool/qmaster
security_mode           none
listener_threads        2
worker_threads          2
scheduler_threads       1
"""
CHANGED = {
    "execd_spool_dir": "{cell}/spool/execd",
    "min_uid": "0",
    "min_gid": "0",
    "load_report_time": "00:00:01",
}
"""Of the configuration that Debian ships: root may run jobs."""
QUEUE = {
    "qname": "all.q",
    "hostlist": "{host}",
    "slots": "{slots}",
    "shell": "/bin/sh",
    "tmpdir": "{cell}/tmp",
    "pe_list": "NONE",
    "load_thresholds": "NONE",
}
FAST = {"schedule_interval": "0:0:1", "flush_submit_sec": "1", "flush_finish_sec": "1"}
PROGRAMS = Path("/usr/lib/gridengine")


class GridEngine:
    """A context; `variables` are those with which qsub and the like find it."""

    def __init__(self, folder, slots=2):
        self.cell, self.slots = Path(folder), slots
        self.root = Path(os.environ.get("SURGEBREAK_SGE", "/"))
        self.daemons = []
        self.variables = {
            "PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}",
            "LD_LIBRARY_PATH": f"{PROGRAMS}{os.pathsep}{self.root / 'usr/lib/x86_64-linux-gnu'}",
            "SGE_ROOT": str(self.cell),
            "SGE_CELL": "default",
            "SGE_ND": "true",
        }

    @staticmethod
    def missing():
        """Why there can be none here; empty where there can."""
        if os.getuid() != 0:
            return "not root"
        names = ("sge_qmaster", "sge_execd", "qsub", "libspoolc.so")
        absent = [name for name in names if not (PROGRAMS / name).exists()]
        return f"no {', '.join(absent)}; see tests/coupler/sge_here.py" if absent else ""

    def __enter__(self):
        host, cell = socket.gethostname(), self.cell
        with contextlib.ExitStack() as both:
            free = [both.enter_context(contextlib.closing(socket.socket())) for _ in range(2)]
            for each in free:
                each.bind(("127.0.0.1", 0))
            ports = [str(each.getsockname()[1]) for each in free]
        self.variables |= {"SGE_QMASTER_PORT": ports[0], "SGE_EXECD_PORT": ports[1]}
        common = cell / "default" / "common"
        for place in (common, cell / "spool/qmaster/job_scripts", cell / "spool/execd", cell / "tmp"):
            place.mkdir(parents=True)
        shared = self.root / "usr/share/gridengine"
        (cell / "util").symlink_to(shared / "util")
        for name in ("bin", "lib", "utilbin"):
            (cell / name).mkdir()
            (cell / name / "lx-amd64").symlink_to(PROGRAMS)
        (common / "bootstrap").write_text(BOOTSTRAP.format(cell=cell, programs=PROGRAMS))
        (common / "act_qmaster").write_text(f"{host}\n")
        (common / "host_aliases").write_text(f"{host} {socket.gethostbyaddr('127.0.0.1')[0]} localhost\n")
        conf = _with((shared / "default-configuration").read_text(), CHANGED, cell=cell)
        (cell / "conf").write_text(conf)
        spool = f"{common};{cell / 'spool/qmaster'}"
        self.run("spoolinit", "classic", "libspoolc", spool, "init")
        self.run("spooldefaults.bin", "configuration", str(cell / "conf"))
        self.run("spooldefaults.bin", "complexes", str(shared / "util/resources/centry"))
        self.run("spooldefaults.bin", "usersets", str(shared / "util/resources/usersets"))
        self.run("spooldefaults.bin", "managers", "root")
        try:
            self._begin(host)
        except BaseException:
            self.__exit__()
            raise
        return self

    def _begin(self, host):
        self._daemon("sge_qmaster")
        until(
            lambda: "execd_spool_dir" in self.output_of("qconf", "-sconf"),
            "an answer of the master",
            report=self._logs,
        )
        self.output_of("qconf", "-ah", host)
        self.output_of("qconf", "-as", host)
        (self.cell / "fast").write_text(_with(self.output_of("qconf", "-ssconf"), FAST))
        self.run("qconf", "-Msconf", str(self.cell / "fast"))
        self._daemon("sge_execd")
        until(
            lambda: "lx-amd64" in self.output_of("qhost", "-h", host),
            "a report of the node",
            report=self._logs,
        )
        (self.cell / "queue").write_text(
            _with(self._plain_queue(), QUEUE, host=host, slots=self.slots, cell=self.cell)
        )
        self.run("qconf", "-Aq", str(self.cell / "queue"))

    def _plain_queue(self):
        """The queue that Grid Engine itself proposes in an editor; one that fails keeps it from being made."""
        shown = self.cell / "proposed"
        editor = self.cell / "editor"
        editor.write_text(f'#!/bin/sh\ncp "$1" {shown}\nexit 1\n')
        editor.chmod(0o755)
        self.output_of("qconf", "-aq", "all.q", EDITOR=str(editor))
        return shown.read_text()

    def _daemon(self, name):
        with (self.cell / f"{name}.out").open("w") as log:
            command = [str(PROGRAMS / name)]
            self.daemons.append(
                subprocess.Popen(command, stdout=log, stderr=log, env=os.environ | self.variables)
            )

    def run(self, name, *words):
        """A program of Grid Engine that must do."""
        subprocess.run([str(PROGRAMS / name), *words], check=True, env=os.environ | self.variables)

    def output_of(self, name, *words, **variables):
        """What a command prints."""
        known = os.environ | self.variables | variables
        done = subprocess.run(
            [str(PROGRAMS / name), *words], capture_output=True, text=True, check=False, env=known
        )
        return done.stdout

    def _logs(self):
        return "\n".join(p.read_text(errors="replace")[-2000:] for p in sorted(self.cell.glob("*.out")))

    def __exit__(self, *_):
        with contextlib.suppress(OSError):
            self.output_of("qdel", "-f", "-u", "root")
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in self.daemons:
            with contextlib.suppress(subprocess.TimeoutExpired):
                daemon.wait(20)
            daemon.kill()


def _with(text, changed, **values):
    """Lines `name value` with some values changed."""
    lines = []
    for line in text.splitlines():
        name = line.split(maxsplit=1)[0] if line.strip() else ""
        lines.append(f"{name} {changed[name].format(**values)}" if name in changed else line)
    return "\n".join(lines) + "\n"
