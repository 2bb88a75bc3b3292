"""Work that takes time: progress, threads, Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import NoReturn

import greyrig
import pytest
from conftest import Command

PROMPT_S = 0.5
"""Within which Ctrl-C has to be obeyed."""


def test_progress_is_told_to_the_thread_that_asks(here: Path) -> None:
    heard: list[tuple[str, float | None, int]] = []
    greyrig.diagnose("steps.csv", progress=lambda doing, part: heard.append((doing, part, threading.get_ident())))
    assert heard and {thread for _, _, thread in heard} == {threading.get_ident()}
    assert all(part is None or 0.0 <= part <= 1.0 for _, part, _ in heard)
    assert len({doing for doing, _, _ in heard}) > 1


def test_what_a_watcher_raises_stops_the_work(here: Path) -> None:
    class Enough(Exception):
        pass

    def enough(doing: str, part: float | None) -> NoReturn:
        raise Enough

    with pytest.raises(Enough):
        greyrig.diagnose("steps.csv", progress=enough)


def test_a_bar_is_shown_where_it_is_asked_for(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    greyrig.diagnose("steps.csv")
    assert capsys.readouterr().err == "", "nobody watches"
    greyrig.diagnose("steps.csv", progress=True)
    assert "%" in capsys.readouterr().err


def test_other_threads_go_on(here: Path) -> None:
    counted, done = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.wait(0.001):
            counted += 1

    counter = threading.Thread(target=count)
    counter.start()
    begin = time.monotonic()
    greyrig.diagnose("steps.csv", threads=1)
    took = time.monotonic() - begin
    done.set()
    counter.join()
    # With the lock held throughout, it would have counted to one or two.
    assert counted > 20 * took


def test_threads_do_not_change_the_answer(here: Path) -> None:
    one, two = (greyrig.identify("steps.csv", threads=threads) for threads in (1, 2))
    assert one.to_json() == two.to_json()


@pytest.mark.parametrize("question", ["diagnose", "add", "identify"])
def test_ctrl_c(question: str, command: Command, tmp_path: Path) -> None:
    # Long enough that it is not done before.
    name = f"long-{question}.csv"
    simulated = command("simulate", "--seconds", "30", "--effect", "saturation", "--out", name, "--force")
    assert simulated.code == 0, simulated.err
    out = tmp_path / "model.toml"
    model = greyrig.load_model("model.toml")
    long = greyrig.load(name)
    universal = greyrig.identify(long, method="least-squares").model if question == "add" else model
    sent: list[float] = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.3, interrupt)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            if question == "diagnose":
                greyrig.diagnose(long)
            elif question == "add":
                greyrig.add(["saturation", "hysteresis"], long, universal, out=out)
            else:
                greyrig.identify([long], effects=["saturation", "hysteresis", "eddy_current"], out=out)
        took = time.monotonic() - sent[0]
    finally:
        timer.join()
    assert took < PROMPT_S, f"{took:.2f} s"
    assert not out.exists()
    assert _ends(), "and nothing works on"


def _ends() -> bool:
    """Whether the threads of the work end: the process takes a fifth of a processor at most, for a fifth of a second."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        spent = time.process_time()
        time.sleep(0.2)
        if time.process_time() - spent <= 0.04:
            return True
    return False
