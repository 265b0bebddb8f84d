"""The page that lives: what it knows of runs, who may ask it, and how it behaves in a real browser."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request

import numpy as np
import pytest

from coupler.commands.watch.command import serving
from coupler.commands.watch.server import Site
from coupler.commands.watch.state import Watched, runs_in
from coupler.program.process import environment
from coupler.results.history import HistoryTable
from coupler.run.pace import GROWTH, MOST_GROWTH, Calm, Fall, Pace
from tests.coupler.browser import CHROMIUM, Browser
from tests.coupler.fake_runs import SUMMARY
from tests.coupler.resumed import DRY

CASE = {"case": {"title": "made up"}, "time": {"end": 4.0}, "limits": {"volume_error": 0.02}}


def make_run(path, process, status="running", time_reached=1.0, **more):
    """A run directory as a run leaves it while it goes on."""
    (path / "history").mkdir(parents=True)
    figures = {"time": time_reached, "largest_volume_error": 0.01}
    reported = {"status": status, "exit_code": None, "exit_reason": None, "ended": None, "process": process}
    (path / "run.json").write_text(json.dumps(SUMMARY | reported | {"figures": figures, "case": CASE} | more))
    with HistoryTable(path / "history" / "gauges.csv", [("time", "s", "t"), ("force_x", "N", "f")]) as table:
        for k in range(11):
            table.append(time=0.1 * k, force_x=1e6 * k)
    (path / "progress.json").write_text(
        json.dumps({"time": time_reached, "end": 4.0, "left": 65.0, "figures": {}, "written": time.time()})
    )
    return path


@pytest.fixture
def sleeper():
    """A process that stands for that of a run."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    yield process
    process.kill()
    process.wait()


def test_a_running_run_says_how_far_it_is_and_how_near_its_limits(tmp_path, sleeper):
    state = Watched(make_run(tmp_path / "run", sleeper.pid)).state()
    assert (state["status"], state["running"], state["share"], state["left"]) == ("running", True, 0.25, 65.0)
    assert state["limits"] == [
        {"what": "volume of water missing in the balance", "share": 0.5, "key": "limits.volume_error"}
    ]
    (curve,) = state["curves"]
    assert (curve["name"], curve["unit"], curve["y"][-1]) == ("force x", "N", 1e7)


def test_a_killed_run_is_seen_to_be_gone(tmp_path, sleeper):
    watched = Watched(make_run(tmp_path / "run", sleeper.pid))
    sleeper.kill()
    sleeper.wait()
    state = watched.state()
    assert (state["status"], state["running"], state["left"]) == ("killed", False, None)
    assert "surgebreak resume" in state["reason"]


def test_a_torn_summary_does_not_take_the_page_down(tmp_path, sleeper):
    path = make_run(tmp_path / "run", sleeper.pid)
    (path / "run.json").write_text("{")
    assert Watched(path).state()["status"] == "unreadable"


def test_runs_of_a_case_and_of_a_sweep_are_found(tmp_path, sleeper):
    one = make_run(tmp_path / "case" / "runs" / "a", sleeper.pid)
    two = make_run(tmp_path / "sweep" / "runs" / "b", sleeper.pid)
    assert set(runs_in([tmp_path])) == {one, two}
    assert runs_in([one]) == [one]


def ask(address, method="GET", **headers):
    """Status and body of an answer."""
    request = urllib.request.Request(
        address, method=method, headers=headers, data=b"" if method == "POST" else None
    )
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, b""


def test_only_who_knows_the_address_may_look_and_stop(tmp_path, sleeper):
    """A wrong secret, a foreign host name (DNS rebinding) and a stop that nobody confirmed are refused."""
    run = make_run(tmp_path / "run", sleeper.pid)
    with serving([run], pictures=False) as address:
        assert address.startswith("http://127.0.0.1:")
        status, page = ask(address)
        assert (status, b"<title>surgebreak" in page) == (200, True)
        assert ask(address.rsplit("/", 2)[0] + "/guess/")[0] == 403
        assert ask(address, Host="evil.example")[0] == 403
        assert ask(address + "nothing")[0] == 404
        next(urllib.request.urlopen(address + "events", timeout=30))  # the runs are numbered now
        assert ask(address + "stop/0", "POST")[0] == 400
        assert ask(address + "stop/7", "POST", **{"X-Confirmed": "yes"})[0] == 404
        assert not (run / "stop").exists()
        assert ask(address + "stop/0", "POST", **{"X-Confirmed": "yes"})[0] == 200
        assert (run / "stop").exists()


def states(site):
    """What the page is sent now, without the wait between two looks."""
    site._read = site._searched = -np.inf
    return json.loads(site.message())


def test_a_run_keeps_its_number_when_another_begins_or_ends(tmp_path, sleeper):
    """Runs are shown in the order of their last change; the number by which one is stopped is another thing, or the
    wrong run would be stopped by whoever reads the question while another one changes."""
    first, second = (make_run(tmp_path / "runs" / name, sleeper.pid) for name in ("first", "second"))
    os.utime(first / "run.json", (1000, 1000))
    os.utime(second / "run.json", (2000, 2000))
    site = Site([tmp_path])
    shown = {state["path"]: state["number"] for state in states(site)}
    assert list(shown) == [str(second), str(first)]
    os.utime(first / "run.json", (3000, 3000))
    third = make_run(tmp_path / "runs" / "third", sleeper.pid)
    again = {state["path"]: state["number"] for state in states(site)}
    assert list(again) == [str(third), str(first), str(second)]
    assert again.items() > shown.items()
    assert [site.run(str(again[str(path)])).path for path in (first, second, third)] == [first, second, third]


def test_the_page_asks_nothing_from_outside():
    from coupler.commands.watch.server import PAGE

    text = PAGE.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert "http:" not in text
    assert "https:" not in text
    assert "//" not in text.replace("</", "")


# ---------------------------------------------------------------- time to go


def test_the_time_to_go_follows_a_pace_that_changes():
    """1 s of the processor for each 0.1 s until t = 2, then 4 s: at t = 3 another 40 s are to go; the mean says 20."""
    pace = Pace(4.0)
    now = 0.0
    for k in range(1, 31):
        now += 1.0 if k <= 20 else 4.0
        pace.add(0.1 * k, now, now)
    assert 0.67 < pace.left() / 40.0 < 1.33


def test_other_programs_that_come_make_the_time_to_go_longer():
    """The run gets half a core from t = 1 on: what is left takes twice as long on the clock, from a minute later on."""
    pace = Pace(4.0)
    now = 0.0
    for k in range(1, 21):
        now += 10.0 if k <= 10 else 20.0
        pace.add(0.1 * k, now, 10.0 * k)
    assert pace.left() == pytest.approx(2.0 * 200.0)


def test_the_time_to_go_is_known_at_the_moment_the_water_arrives():
    """Asked before the next step has ended, nothing has been seen of the new pace yet: the last step stands for it."""
    pace = Pace(1.0)
    pace.expect(True, False)
    for k in range(1, 6):
        pace.add(0.1 * k, float(k), float(k))
    pace.expect(False, False)
    assert pace.left() == pytest.approx(5.0)
    assert pace.between() is None


def test_two_times_are_told_until_it_is_known_how_much_breaks():
    """1 s a tenth while the water comes, 4 s from the first break at half of the run: at first both ends are told,
    after a tenth of the run its own pace alone."""
    pace, used = Pace(10.0), 0.0
    pace.expect(True, False)
    for k in range(1, 51):
        used += 1.0
        pace.add(0.1 * k, used, used)
    assert pace.between() == pytest.approx((50.0, MOST_GROWTH * 50.0))
    pace.expect(False, True)
    for k in range(51, 62):
        used += 4.0
        pace.add(0.1 * k, used, used)
        left, between = 4.0 * (100 - k), pace.between()
        if k < 60:
            assert between[0] <= pace.left() <= between[1]
            assert between[0] == pytest.approx(left)
        else:
            assert between is None
    assert pace.left() == pytest.approx(4.0 * 39)


def test_a_first_break_after_the_calm_is_an_event_of_its_own():
    """Nothing broke for long after the water came, so that one time was told; then joints break after all."""
    pace = Pace(10.0)
    pace.expect(True, False)
    for k in range(1, 51):
        pace.add(0.1 * k, float(k), float(k))
    pace.expect(False, False)
    assert pace.between() is None
    for k in range(51, 61):
        pace.expect(False, False)
        pace.add(0.1 * k, float(k), float(k))
    pace.expect(False, True)
    pace.add(6.1, 62.0, 62.0)
    least, most = pace.between()
    assert most == pytest.approx(MOST_GROWTH * 39.0, rel=0.05)
    assert least < pace.left() < most
    pace.expect(False, True)
    pace.add(6.2, 64.0, 64.0)
    assert pace.between() is not None, "a second break is no new event, and the first is still young"


def test_what_falls_is_expected_to_hit():
    """Kinetic energy grows until 0.6 s and is gone at 0.8 s; nothing that never moved is waited for."""
    fall = Fall()
    assert not fall.now(0.0, 0.0)
    assert not fall.ended
    assert [fall.now(0.1 * k, float(k * k)) for k in range(1, 7)] == [True] * 6
    assert fall.now(0.7, 20.0)
    assert not fall.now(0.8, 10.0)
    assert fall.ended
    slides = Fall()
    assert slides.now(1.0, 5.0)
    assert not slides.now(1.6, 5.0), "what goes on at one speed has nothing to hit"


def test_what_was_calm_is_forgotten_when_the_water_arrives():
    """1 s a tenth before, 3 s after: half a second later 1.4 of 2 s are to go, at 3 s a tenth; before, GROWTH stands
    for that."""
    pace, used = Pace(2.0), 0.0
    pace.expect(True, False)
    for k in range(1, 11):
        used += 1.0 if k <= 5 else 3.0
        if k == 5:
            pace.add(0.1 * k, used, used)
            assert pace.left() == pytest.approx(GROWTH * 15.0)
            pace.expect(False, False)
            continue
        pace.add(0.1 * k, used, used)
    assert pace.left() == pytest.approx(30.0)


def test_calm_ends_with_the_first_break_or_some_time_after_the_water():
    calm = Calm()
    assert calm.now(0.5, wet=False, joints=9, broken=0)
    assert calm.now(1.0, wet=True, joints=9, broken=0)
    assert calm.now(1.4, wet=True, joints=9, broken=0)
    assert not calm.now(1.6, wet=True, joints=9, broken=0)
    assert not calm.now(1.2, wet=True, joints=8, broken=1)
    crates = Calm()
    assert crates.now(0.1, wet=False, joints=0, broken=0)
    assert not crates.now(0.2, wet=True, joints=0, broken=0), (
        "nothing can break: all is known when they are wet"
    )
    pace = Pace(2.0)
    for k in (1, 2, 3):
        pace.add(0.1 * k, float(k), float(k))
    plain = pace.left()
    pace.expect(True, False)
    assert pace.left() == pytest.approx(GROWTH * plain)


# ---------------------------------------------------------------- in a real browser

in_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")


def asked(page) -> None:
    """Press s on the second run until it asks: a page that is drawn anew in between has lost the focus."""

    def ask():
        if page.value("document.getElementById('ask').open"):
            return True
        page.value("document.querySelectorAll('article')[1].focus()")
        page.key("s")
        return None

    Browser.wait(ask)


@in_browser
def test_keys_and_the_confirmation_of_a_stop(tmp_path, sleeper):
    """j goes to the next run, s asks, one button lets it be, one stops it; a phone needs no sideways scrolling."""
    pytest.importorskip("tornado")
    first = make_run(tmp_path / "a", sleeper.pid)
    second = make_run(tmp_path / "b", sleeper.pid)
    with serving([first, second], pictures=False) as address, Browser(tmp_path / "profile", 390, 800) as page:
        page.open(address)
        page.until("document.querySelectorAll('article').length == 2")
        assert page.value("document.getElementById('link').textContent") == "live"
        assert "about 1 min 05 s left" in page.value("document.body.innerText")
        assert page.value("document.querySelectorAll('svg path').length") == 2
        assert page.value("document.documentElement.scrollWidth <= window.innerWidth")
        page.key("j")
        page.key("j")
        assert page.value("document.activeElement.id") == "run1"
        asked(page)
        page.value("document.querySelector('dialog button[value=no]').click()")
        assert not (second / "stop").exists()
        asked(page)
        page.value("document.querySelector('dialog button[value=yes]').click()")
        Browser.wait(lambda: True if (second / "stop").exists() else None)
        assert not (first / "stop").exists()
        page.until("document.body.innerText.includes('stopping')")


@in_browser
def test_the_page_is_dark_where_the_system_is(tmp_path, sleeper):
    pytest.importorskip("tornado")
    run = make_run(tmp_path / "a", sleeper.pid)
    with serving([run], pictures=False) as address, Browser(tmp_path / "profile") as page:
        page.open(address)
        page.until("document.querySelectorAll('article').length == 1")
        look = "getComputedStyle(document.body).backgroundColor"
        colours = []
        for scheme in ("light", "dark"):
            page.call(
                "Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}]
            )
            colours.append(page.value(look))
        assert colours == ["rgb(255, 255, 255)", "rgb(20, 24, 30)"]


def surgebreak(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "coupler.cli", *map(str, words)],
        env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.mark.nightly
@in_browser
def test_a_run_that_is_killed_and_goes_on(tmp_path):
    """A real run: the page sees it go, sees that it was killed, and sees it resumed and done with its verdict."""
    pytest.importorskip("tornado")
    (tmp_path / "case.toml").write_text(DRY.replace('end = "0.1 s"', 'end = "1 s"'))
    run = tmp_path / "run"
    process = surgebreak("run", tmp_path, "--output", run)
    Browser.PATIENCE = 600.0
    with serving([run.parent], pictures=False) as address, Browser(tmp_path / "profile") as page:
        page.open(address)
        page.until(
            "document.querySelector('.status') && document.querySelector('.status').textContent == 'running'"
        )
        page.until("document.querySelector('progress') && document.querySelector('progress').value > 0.2")
        process.send_signal(signal.SIGKILL)
        process.wait()
        page.until("document.querySelector('.status').textContent == 'killed'")
        surgebreak("resume", run, "--any-version").wait()
        page.until("document.querySelector('.status').textContent == 'done'")
        text = page.value("document.body.innerText")
        assert "resumed 1 times" in text
        assert "100 %" in text
        assert "DAMAGED" in text or "COLLAPSED" in text
