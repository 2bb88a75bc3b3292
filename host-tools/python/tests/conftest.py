"""Recordings of virtual motors, and the command beside the package."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest


@dataclass(frozen=True)
class Ran:
    """What a command said."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        return json.loads(self.out)


Command = Callable[..., Ran]


def _run(folder: Path, *arguments: str) -> Ran:
    program = os.environ.get("GREYRIG")
    if program is None:
        pytest.fail("GREYRIG names no greyrig; run `cargo xtask python`")
    ran = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    return Ran(ran.returncode, ran.stdout, ran.stderr)


@pytest.fixture(scope="session")
def motors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A magnet motor whose brushes drop more than the base model knows: three runs, and a model of the first."""
    folder = tmp_path_factory.mktemp("motors")
    motor = ["simulate", "--kind", "pm-dc", "--effect", "brush_drop"]
    for name, profile, seed in [("steps.csv", "dc-steps", "1"), ("ramp.csv", "dc-ramp", "2"), ("again.csv", "dc-steps", "3")]:
        ran = _run(folder, *motor, "--profile", profile, "--seconds", "6", "--seed", seed, "--out", name)
        assert ran.code == 0, ran.err
    ran = _run(folder, "identify", "steps.csv", "--out", "model.toml")
    assert ran.code == 0, ran.err
    return folder


@pytest.fixture
def here(motors: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the recordings, in which the test runs: names are those that the command is given."""
    monkeypatch.chdir(motors)
    return motors


@pytest.fixture
def command(here: Path) -> Command:
    """Runs the command in that folder."""
    return lambda *arguments: _run(here, *arguments)
