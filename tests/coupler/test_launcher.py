"""The launcher `./surgebreak` on machines that are not ready: what it runs, in which order, and what it says.

apt, sudo, Python and the like are stand-ins on the PATH that write down how they were called.
"""

import os
import shutil
import signal
import subprocess
import time

import pytest

from coupler.commands.cli import app
from coupler.program.provenance import ROOT

TOOLS = (
    "sh",
    "cat",
    "cksum",
    "readlink",
    "sed",
    "date",
    "sleep",
    "mkdir",
    "rm",
    "tail",
    "cut",
    "du",
    "grep",
    "env",
)
VENV = """#!/bin/sh
# stands for python -m venv: a .venv whose python and surgebreak write down what they are asked
mkdir -p "$1/bin"
printf '#!/bin/sh\\n echo "python $*" >>"$CALLS"\\n case "$*" in \\
*--force-reinstall*) rm "$STATE/torn";; *" pip install "*) [ -z "$PIP_FAILS" ];; \\
*"import coupler"*) [ ! -e "$STATE/torn" ];; esac\\n' \\
    >"$1/bin/python"
printf '#!/bin/sh\\n echo "surgebreak $*" >>"$CALLS"\\n' >"$1/bin/surgebreak"
chmod +x "$1/bin/python" "$1/bin/surgebreak"
"""
PYTHON = """#!/bin/sh
echo "system-python $*" >>"$CALLS"
case $* in
"-m venv "*) exec sh "$STUBS/make-venv" "$3" ;;
*ensurepip*) [ -e "$STATE/venv-module" ] ;;
*version_info*) [ -z "$OLD_PYTHON" ] ;;
esac
"""
APT_GET = """#!/bin/sh
echo "apt-get $*" >>"$CALLS"
case $* in
*install*) [ -z "$APT_FAILS" ] && touch "$STATE/venv-module" && mkdir -p "$STATE/yade" ;;
esac
"""


class Machine:
    """A checkout with the launcher alone, a PATH of stand-ins, and a list of the calls they got."""

    def __init__(self, folder):
        self.root, self.stubs, self.state = folder / "checkout", folder / "bin", folder / "state"
        for place in (self.root, self.stubs, self.state):
            place.mkdir()
        for name in ("surgebreak", "pyproject.toml", "constraints.txt"):
            shutil.copy(ROOT / name, self.root / name)
        for name in (*TOOLS, "touch", "chmod"):
            (self.stubs / name).symlink_to(shutil.which(name))
        self.stub("make-venv", VENV)
        self.stub("python3", PYTHON)
        self.stub("apt-get", APT_GET)
        self.stub("apt-cache", '#!/bin/sh\n[ -z "$NO_PACKAGE" ]\n')
        self.stub("uname", "#!/bin/sh\necho Linux\n")
        self.stub("dpkg-query", "#!/bin/sh\nexit 1\n")
        self.stub("dpkg", '#!/bin/sh\necho "dpkg $*" >>"$CALLS"\n')
        self.stub("id", "#!/bin/sh\necho ${USER_NUMBER:-0}\n")
        (folder / "os-release").write_text('PRETTY_NAME="Debian GNU/Linux 12 (bookworm)"\n', encoding="utf-8")
        self.environment = {
            "PATH": str(self.stubs),
            "CALLS": str(folder / "calls"),
            "STUBS": str(self.stubs),
            "STATE": str(self.state),
            "SURGEBREAK_PYTHON": str(self.stubs / "python3"),
            "SURGEBREAK_YADE": str(self.state / "yade"),
            "SURGEBREAK_OS_RELEASE": str(folder / "os-release"),
        }

    def stub(self, name, text):
        path = self.stubs / name
        path.unlink(missing_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)

    def ready(self):
        (self.state / "venv-module").touch()
        (self.state / "yade").mkdir()
        return self

    def __call__(self, *arguments, program=None, cwd=None, **environment):
        """Exit code, messages and the calls of this call alone, without that by which `doctor` tries whether the
        program starts."""
        calls = self.root.parent / "calls"
        calls.write_text("", encoding="utf-8")
        done = subprocess.run(
            [program or self.root / "surgebreak", *arguments],
            capture_output=True, text=True, check=False, cwd=cwd, env=self.environment | environment, timeout=30,
        )  # fmt: skip
        made = calls.read_text(encoding="utf-8").splitlines()
        return done.returncode, done.stderr, [call for call in made if "import coupler" not in call]


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


def pip_installs(calls):
    return [call.split(" -e ")[1].split("checkout")[1] for call in calls if " pip install " in call]


def test_the_first_call_on_a_fresh_machine_sets_everything_up(machine):
    """apt for YADE and venv, a .venv, the pinned packages, then the command itself."""
    case = str(machine.root)
    code, reported, calls = machine("run", case, "--end", "1 s")
    assert code == 0
    assert "apt-get install -q -y --no-install-recommends -o Dpkg::Use-Pty=0 yade python3-venv" in calls
    assert any(call.startswith("system-python -m venv") for call in calls)
    assert pip_installs(calls) == [""]
    assert any("-c " + str(machine.root / "constraints.txt") in call for call in calls)
    assert calls[-1] == f"surgebreak run {case} --end 1 s"
    assert "installing yade python3-venv from apt" in reported
    assert "set up in " in reported


def test_later_calls_start_at_once(machine):
    """No apt, no pip, no word: one process, the command itself."""
    machine("run", str(machine.root))
    code, reported, calls = machine("run", "x")
    assert (code, reported, calls) == (0, "", ["surgebreak run x"])


def test_an_existing_yade_is_honoured(machine):
    _, _, calls = machine.ready()("doctor")
    assert not any(call.startswith("apt-get") for call in calls)


def test_a_yade_below_a_folder_with_a_blank_in_its_name_is_honoured(machine):
    """As a user has it who unpacked the packages into a home of his own, without root."""
    place = machine.state / "Käthe Übel" / "yade"
    place.mkdir(parents=True)
    (machine.state / "venv-module").touch()
    code, reported, calls = machine("doctor", SURGEBREAK_YADE=str(place), USER_NUMBER="1000")
    assert code == 0, reported
    assert not any(call.startswith("apt-get") for call in calls)


def test_a_yade_known_to_the_package_system_is_honoured_wherever_it_is(machine):
    machine.stub("dpkg-query", "#!/bin/sh\necho installed\n")
    (machine.state / "venv-module").touch()
    _, _, calls = machine("doctor")
    assert not any(call.startswith("apt-get") for call in calls)


def test_a_yade_that_an_interrupted_apt_left_half_done_is_finished(machine):
    """Its folder is there already, but its packages are not set up."""
    machine.ready().stub("dpkg-query", "#!/bin/sh\necho half-configured\n")
    _, _, calls = machine("doctor")
    assert "dpkg --configure -a" in calls
    assert "apt-get install -q -y --no-install-recommends -o Dpkg::Use-Pty=0 yade" in calls


def test_extras_come_with_the_command_that_needs_them(machine):
    machine.ready()
    assert pip_installs(machine("doctor")[2]) == [""]
    assert pip_installs(machine("--quiet", "render", "r")[2]) == ["[view]"]
    assert pip_installs(machine("render", "r")[2]) == []
    assert pip_installs(machine("report", "r")[2]) == []
    assert pip_installs(machine("test")[2]) == ["[test]"]
    assert pip_installs(machine("benchmark")[2]) == ["[benchmark]"]
    assert pip_installs(machine("blocks", "x.stl")[2]) == ["[drawing]"]
    assert pip_installs(machine("test", "render")[2]) == []


def test_a_run_installs_no_extra_and_compiles_nothing_by_itself(machine):
    """The program compiles what the case needs, once it has read the case."""
    machine.ready()
    machine("doctor")
    assert machine("run", "x")[2] == ["surgebreak run x"]


@pytest.mark.parametrize(
    "command", ["run", "render", "report", "blocks", "benchmark", "sweep", "docs", "test"]
)
@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help_of_a_command_installs_none_of_its_extras(machine, command, word):
    """850 MB of pictures for a page of help was what the first user got."""
    machine.ready()
    machine("doctor")
    code, reported, calls = machine(command, word)
    assert (code, calls) == (0, [f"surgebreak {command} {word}"])
    assert "installing" not in reported


def test_the_tab_key_installs_nothing(machine):
    """The shell asks for completions by a variable; an installation that is not there completes nothing."""
    done = subprocess.run(
        [machine.root / "surgebreak"],
        capture_output=True,
        text=True,
        check=False,
        env=machine.environment | {"_SURGEBREAK_COMPLETE": "complete_bash"},
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (machine.root / ".venv").exists()


@pytest.mark.parametrize(
    "words", [("run",), ("run", "--set"), ("run", "--set", "a=1"), ("check", "--end", "1 s")]
)
def test_nothing_is_set_up_without_a_case(machine, words):
    code, reported, calls = machine(*words)
    assert (code, calls) == (2, [])
    assert f"{words[0]}: which case? Write surgebreak {words[0]} CASE" in reported


@pytest.mark.parametrize(
    "words", [("--help",), ("render", "--help"), ("benchmark", "-h"), ("run", "-h"), ("test", "--help")]
)
def test_help_installs_nothing(machine, words):
    """Before the set-up the launcher says what there is; after it the program does, without the extras."""
    code, reported, calls = machine(*words)
    assert (code, reported, calls) == (0, "", [])
    machine.ready()("doctor")
    assert machine(*words)[::2] == (0, ["surgebreak " + " ".join(words)])


def test_help_names_the_commands_of_the_program(machine):
    reported = subprocess.run(
        [machine.root / "surgebreak", "-h"],
        capture_output=True,
        text=True,
        check=True,
        env=machine.environment,
    ).stdout
    names = [command.name or command.callback.__name__ for command in app.registered_commands]
    listed = reported.partition("Commands: ")[2].partition("\n\n")[0].replace("\n", " ")
    assert sorted(listed.split(", ")) == sorted(names)


@pytest.mark.parametrize("options", [(), ("--set", "time.end=1 s", "--output", "there")])
def test_nothing_is_set_up_for_a_case_that_does_not_exist(machine, options):
    """A slip of the pen should not cost an installation."""
    code, reported, calls = machine("run", *options, "nowhere/x")
    assert (code, calls) == (2, [])
    assert "nowhere/x: no such case" in reported


def test_changed_pins_are_installed_again(machine):
    machine.ready()("doctor")
    with (machine.root / "constraints.txt").open("a", encoding="utf-8") as stream:
        stream.write("# changed\n")
    assert pip_installs(machine("doctor")[2]) == [""]


def test_through_a_link_and_from_another_directory(machine, tmp_path):
    machine.ready()("doctor")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to("checkout/surgebreak")
    (tmp_path / "elsewhere" / "again").symlink_to("../link")
    for program in (tmp_path / "link", tmp_path / "elsewhere" / "again", "../checkout/surgebreak"):
        code, reported, calls = machine("--version", program=program, cwd=tmp_path / "elsewhere")
        assert (code, reported, calls) == (0, "", ["surgebreak --version"])


def test_arguments_arrive_as_they_were_given(machine):
    machine.ready()("run", str(machine.root))
    machine.stub("show", "")
    (machine.root / ".venv/bin/surgebreak").write_text(
        '#!/bin/sh\nprintf "<%s>" "$@" >>"$CALLS"\n', encoding="utf-8"
    )
    assert machine("run", "--set", "a=b c", "", "*")[2] == ["<run><--set><a=b c><><*>"]


def test_the_exit_code_of_the_command_is_returned(machine):
    machine.ready()("doctor")
    (machine.root / ".venv/bin/surgebreak").write_text("#!/bin/sh\nexit 3\n", encoding="utf-8")
    assert machine("doctor")[0] == 3


# ---------------------------------------------------------------- where it cannot work


def test_sudo_is_used_by_ordinary_users(machine):
    machine.stub("sudo", '#!/bin/sh\necho "sudo $*" >>"$CALLS"\n[ "$1" = -v ] || exec "$@"\n')
    code, _, calls = machine("doctor", USER_NUMBER="1000")
    assert code == 0
    assert calls[-1] == "surgebreak doctor"
    assert any(call.startswith("sudo env DEBIAN_FRONTEND=noninteractive apt-get install") for call in calls)
    assert not any("pip" in call for call in calls if call.startswith("sudo"))


@pytest.mark.parametrize("sudo", [None, "#!/bin/sh\nexit 1\n"], ids=["absent", "refuses"])
def test_neither_root_nor_sudo_says_what_to_ask_for(machine, sudo):
    if sudo:
        machine.stub("sudo", sudo)
    code, reported, calls = machine("doctor", USER_NUMBER="1000")
    assert code == 1
    assert "    apt-get install --no-install-recommends yade python3-venv" in reported
    assert "sudo is absent or refused" in reported
    assert not any(call.startswith("apt-get") for call in calls)


def test_without_apt(machine):
    (machine.stubs / "apt-get").unlink()
    code, reported, _ = machine("doctor")
    assert code == 1
    assert (
        "Debian GNU/Linux 12 (bookworm) has no apt-get; surgebreak takes the engine YADE from the packages"
        in reported
    )


def test_another_system(machine):
    machine.stub("uname", "#!/bin/sh\necho Darwin\n")
    code, reported, _ = machine("doctor")
    assert code == 1
    assert "this system is Darwin; surgebreak needs Debian 12 or a derivative" in reported


def test_a_derivative_without_the_package(machine):
    code, reported, _ = machine("doctor", NO_PACKAGE="1")
    assert code == 1
    assert "offers no package 'yade'" in reported


def test_a_python_that_is_too_old(machine):
    code, reported, _ = machine.ready()("doctor", OLD_PYTHON="1")
    assert code == 1
    assert "needs the system's Python 3.11 or later" in reported


def test_a_failing_apt_is_reported_and_repeated(machine):
    code, reported, calls = machine("doctor", APT_FAILS="1")
    assert code == 1
    assert "apt-get could not install yade python3-venv" in reported
    assert not any("venv" in call for call in calls if call.startswith("system-python -m"))
    assert machine("doctor")[0] == 0


def test_a_failing_pip_is_reported_and_repeated_without_starting_over(machine):
    """Without network nothing has been written yet: the next call goes on where this one stopped."""
    machine.ready()
    code, reported, calls = machine("doctor", PIP_FAILS="1")
    assert code == 1
    assert "pip could not install the packages" in reported
    assert not any(call.startswith("surgebreak") for call in calls)
    code, reported, calls = machine("doctor")
    assert (code, calls[-1]) == (0, "surgebreak doctor")
    assert not any(call.startswith("system-python -m venv") for call in calls)


def test_the_doctor_mends_a_program_that_does_not_start(machine):
    """Of a damaged package pip says that it is there: only fetching it again helps. Without --mend nothing changes."""
    machine.ready()("doctor")
    (machine.state / "torn").touch()
    code, reported, calls = machine("doctor")
    assert code == 1
    assert "the program does not start" in reported
    assert "./surgebreak doctor --mend installs its packages again" in reported
    assert pip_installs(calls) == []
    code, reported, calls = machine("doctor", "--mend")
    assert (code, calls[-1]) == (0, "surgebreak doctor --mend")
    assert "a package is damaged; fetching all of them again" in reported
    assert [("--force-reinstall" in call) for call in calls if " pip install " in call] == [False, True]


def test_packages_half_written_by_an_interrupted_set_up_are_thrown_away(machine):
    """A wheel of which half is on disk looks installed to pip; so the folder is made again."""
    machine.ready()("doctor")
    stamps = machine.root / ".venv" / ".set-up"
    (stamps / "unfinished").write_text("view\n", encoding="utf-8")
    (stamps / "view.log").write_text("Installing collected packages: numpy\n", encoding="utf-8")
    (machine.root / ".venv" / "half").touch()
    code, reported, calls = machine("doctor")
    assert code == 0
    assert "an earlier set-up was interrupted; starting it again" in reported
    assert not (machine.root / ".venv" / "half").exists()
    assert any(call.startswith("system-python -m venv") for call in calls)


def test_ctrl_c_during_the_set_up_leaves_a_state_that_the_next_call_mends(machine):
    """The launcher and pip get the signal together, as from a terminal."""
    machine.ready().stub("slow", "#!/bin/sh\necho started >&2\nexec sleep 20\n")
    machine.stub("make-venv", VENV.replace('[ -z "$PIP_FAILS" ]', 'sh "$STUBS/slow"'))
    (machine.root.parent / "calls").touch()
    child = subprocess.Popen(
        [machine.root / "surgebreak", "doctor"], env=machine.environment, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    log = machine.root / ".venv" / ".set-up" / "core.log"
    until = time.monotonic() + 20
    while not (log.exists() and "started" in log.read_text(encoding="utf-8")):
        assert time.monotonic() < until
        time.sleep(0.02)
    os.killpg(child.pid, signal.SIGINT)
    _, reported = child.communicate(timeout=20)
    assert child.returncode == 130
    assert "interrupted; the next call starts this part again" in reported
    machine.stub("slow", "#!/bin/sh\n")
    code, _, calls = machine("doctor")
    assert (code, calls[-1]) == (0, "surgebreak doctor")


def test_a_checkout_whose_path_has_a_blank_and_an_umlaut(tmp_path):
    """pip takes PIP_CONSTRAINT for a list with blanks between: the name in it must hold none."""
    (tmp_path / "my schöner folder").mkdir()
    machine = Machine(tmp_path / "my schöner folder")
    machine.stub(
        "make-venv",
        VENV.replace('echo "python $*"', 'echo "python $* [$PIP_CONSTRAINT] in $(pwd)"'),
    )
    code, _, calls = machine.ready()("doctor")
    (pip,) = [call for call in calls if " pip install " in call]
    assert code == 0
    assert pip.endswith(
        f"-c {machine.root}/constraints.txt -e {machine.root} [constraints.txt] in {machine.root}"
    )


@pytest.mark.parametrize(
    ("folder", "locale", "passed"),
    [
        ("schöner", {"LC_ALL": "C"}, "C.UTF-8"),
        ("schöner", {"LANG": "de_DE.ISO-8859-1"}, "C.UTF-8"),
        ("schöner", {"LANG": "de_DE.UTF-8"}, ""),
        ("schöner", {"LC_ALL": "en_GB.utf8"}, "en_GB.utf8"),
        ("plain ~folder", {"LC_ALL": "C"}, "C"),
    ],
)
def test_a_path_with_an_umlaut_in_a_locale_without(tmp_path, folder, locale, passed):
    """Python would not start: it reads where its packages are in the encoding of the locale."""
    (tmp_path / folder).mkdir()
    machine = Machine(tmp_path / folder).ready()
    machine("doctor")
    (machine.root / ".venv/bin/surgebreak").write_text(
        '#!/bin/sh\necho "[$LC_ALL]" >>"$CALLS"\n', encoding="utf-8"
    )
    assert machine("doctor", **locale)[2] == [f"[{passed}]"]


@pytest.mark.parametrize(
    ("log", "reported"),
    [
        ("OSError: [Errno 28] No space left on device", "The disk is full"),
        ("Connection to pypi.org timed out", "look at network and proxy"),
        ("ERROR: Invalid requirement: 'schöner'", "The last lines say why"),
    ],
)
def test_pip_fails_for_the_reason_that_its_log_tells(machine, log, reported):
    machine.stub("make-venv", VENV.replace('[ -z "$PIP_FAILS" ]', f'echo "{log}"; exit 1'))
    code, said, _ = machine.ready()("doctor")
    assert code == 1
    assert f"{reported}" in said.splitlines()[-1]


def as_a_user_who_may_only_read(machine, *words, **environment):
    """Root may write everywhere; so another user calls, who may write into the lists of the test alone."""
    private = [
        place for place in machine.root.parents if place.stat().st_mode & 0o777 == 0o700
    ]  # pytest's own
    for place in (machine.root, *private):
        place.chmod(0o755)
    (machine.root.parent / "calls").touch()
    (machine.root.parent / "calls").chmod(0o666)
    user = {"user": 65534, "group": 65534} if os.getuid() == 0 else {}
    if not user:
        machine.root.chmod(0o555)
    done = subprocess.run(
        [machine.root / "surgebreak", *words], capture_output=True, text=True, check=False, **user,
        env=machine.environment | environment,
    )  # fmt: skip
    machine.root.chmod(0o755)
    return (
        done.returncode,
        done.stderr,
        (machine.root.parent / "calls").read_text(encoding="utf-8").splitlines(),
    )


def test_a_checkout_that_one_may_only_read(machine):
    """Either another place for the packages, or a word about it; never half an installation."""
    code, reported, calls = as_a_user_who_may_only_read(machine.ready(), "doctor")
    assert (code, calls) == (1, [])
    assert f"cannot write to {machine.root}/.venv, where the packages go" in reported
    assert "SURGEBREAK_VENV=$HOME/surgebreak-venv" in reported


def test_doctor_looks_at_an_installation_that_one_may_only_read(machine):
    """It wrote a log of whether the program starts beside the packages, and ended there."""
    machine.ready()("doctor")
    code, reported, calls = as_a_user_who_may_only_read(machine, "doctor")
    assert (code, reported) == (0, "")
    assert calls[-1] == "surgebreak doctor"


def test_the_packages_may_go_elsewhere(machine):
    elsewhere = machine.state / "my venv"
    code, _, calls = machine.ready()("doctor", SURGEBREAK_VENV=str(elsewhere))
    assert (code, calls[-1]) == (0, "surgebreak doctor")
    assert (elsewhere / "bin" / "surgebreak").exists()
    assert not (machine.root / ".venv").exists()


def second_checkout(machine):
    """Beside one that is set up, the same without a .venv."""
    machine.ready()("doctor")
    other = machine.root.parent / "checkout of mine"
    other.mkdir()
    for name in ("surgebreak", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, other / name)
    return other


@pytest.mark.parametrize("changed", [False, True], ids=["the same packages", "other packages"])
@pytest.mark.parametrize("words", [("doctor",), ("run", "--help"), ("render", "r")])
def test_the_installation_of_another_checkout_is_refused_through_a_link(machine, changed, words):
    """Its program is that of the other checkout; an installation for this one would change what that one runs."""
    other = second_checkout(machine)
    (other / ".venv").symlink_to("../checkout/.venv")
    if changed:
        (other / "constraints.txt").write_text("# none\n", encoding="utf-8")
    code, reported, calls = machine(*words, program=other / "surgebreak")
    assert (code, calls) == (1, [])
    assert f"{other}/.venv is the installation of another checkout, {machine.root}" in reported
    assert f'Remove the link (rm "{other}/.venv")' in reported
    (other / ".venv").unlink()
    assert machine("doctor", program=other / "surgebreak")[0] == 0
    assert (other / ".venv" / "bin" / "surgebreak").exists()
    assert machine("doctor")[::2] == (0, ["surgebreak doctor"])


def test_the_installation_of_another_checkout_is_refused_by_name(machine):
    other = second_checkout(machine)
    place = machine.root / ".venv"
    code, reported, calls = machine("doctor", program=other / "surgebreak", SURGEBREAK_VENV=str(place))
    assert (code, calls) == (1, [])
    assert "Let SURGEBREAK_VENV name a folder of this checkout's own, or unset it" in reported
    assert machine("doctor", SURGEBREAK_VENV=str(place))[::2] == (0, ["surgebreak doctor"])


def test_the_packages_may_lie_behind_a_link(machine):
    """On a larger disk, for instance; a checkout that is itself reached by a link is still the same one."""
    machine.ready()
    (machine.state / "large").mkdir()
    (machine.root / ".venv").symlink_to(machine.state / "large")
    assert machine("doctor")[0] == 0
    assert (machine.state / "large" / "bin" / "surgebreak").exists()
    (machine.state / "here").symlink_to(machine.root)
    assert machine("doctor", program=machine.state / "here" / "surgebreak")[::2] == (0, ["surgebreak doctor"])


def test_the_installation_of_somebody_else_is_used_as_it_is(machine):
    """Its kernels are compiled into a cache of each user's own."""
    machine.ready()("doctor")
    code, reported, calls = as_a_user_who_may_only_read(machine, "run", "x")
    assert (code, reported, calls[-1]) == (0, "", "surgebreak run x")


def test_a_folder_that_cannot_be_written(machine):
    (machine.root / ".venv").write_text("", encoding="utf-8")
    code, reported, _ = machine.ready()("doctor")
    assert code == 1
    assert "cannot write to " in reported


def test_the_launcher_is_plain_posix():
    """Debian's sh is dash, others' is not; `bash --posix -n` and dash both read it, shellcheck where it is there."""
    for shell in (["dash", "-n"], ["bash", "--posix", "-n"]):
        assert subprocess.run([*shell, ROOT / "surgebreak"], check=False).returncode == 0
    if shutil.which("shellcheck"):
        checked = subprocess.run(
            ["shellcheck", ROOT / "surgebreak"], capture_output=True, text=True, check=False
        )
        assert checked.returncode == 0, checked.stdout
    assert os.access(ROOT / "surgebreak", os.X_OK)
