"""Errors are exceptions with the sentences of the command line."""

from __future__ import annotations

import pickle
from pathlib import Path

import greyrig
import pytest
from conftest import Command, Ran


def sentence(ran: Ran) -> str:
    """The line on stderr."""
    lines = [line for line in ran.err.splitlines() if line.startswith("greyrig: ")]
    return lines[-1].removeprefix("greyrig: ")


def test_a_damaged_file(command: Command, here: Path) -> None:
    Path("damaged.csv").write_text("t_s,u_v,i_a,omega_rad_s\n0,1,2,3\n0.001,1,two,3\n0.002,1,2,3\n")
    ran = command("identify", "damaged.csv", "--json")
    with pytest.raises(greyrig.InputError) as caught:
        greyrig.identify("damaged.csv")
    error = caught.value
    assert str(error) == sentence(ran) and error.code == ran.code == 2
    told = ran.json["error"]
    assert (error.place, error.what, error.remedy) == (told["place"], told["what"], told["remedy"])
    assert error.place == "damaged.csv:3:3"
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("name", ["missing.csv", "missing.xyz"])
def test_no_such_file(command: Command, name: str) -> None:
    ran = command("check", name)
    with pytest.raises(greyrig.FileError) as caught:
        greyrig.load(name)
    assert str(caught.value) == sentence(ran) and isinstance(caught.value, OSError)


def test_a_damaged_model(command: Command, here: Path) -> None:
    text = Path("model.toml").read_text()
    Path("odd.toml").write_text(text.replace("[parameters.K]", "[parameters.Q]"))
    ran = command("compare", "ramp.csv", "--model", "odd.toml")
    with pytest.raises(greyrig.InputError) as caught:
        greyrig.compare("ramp.csv", "odd.toml")
    assert str(caught.value) == sentence(ran)


def test_what_cannot_be_told(command: Command, here: Path) -> None:
    rows = "\n".join(f"{n * 1e-3:.3f},0,0,0" for n in range(3000))
    Path("dead.csv").write_text(f"t_s,u_v,i_a,omega_rad_s\n{rows}\n")
    ran = command("identify", "dead.csv")
    with pytest.raises(greyrig.Error) as caught:
        greyrig.identify("dead.csv")
    assert str(caught.value) == sentence(ran) and caught.value.code == ran.code
    # A diagnosis answers all the same.
    said = command("diagnose", "dead.csv", "--json")
    what = greyrig.diagnose("dead.csv")
    assert what.to_json() == said.out.strip()
    assert what.verdict.kind == "insufficient_data"


def test_an_unknown_effect(command: Command) -> None:
    ran = command("identify", "steps.csv", "--effect", "saturatoin")
    with pytest.raises(greyrig.UsageError) as caught:
        greyrig.identify("steps.csv", effects="saturatoin")
    assert str(caught.value) == sentence(ran)


def test_what_the_model_has(command: Command, here: Path, tmp_path: Path) -> None:
    model = str(tmp_path / "with.toml")
    assert command("identify", "steps.csv", "--effect", "brush_drop", "--out", model).code == 0
    ran = command("add", "brush_drop", "steps.csv", "--model", model)
    with pytest.raises(greyrig.UsageError) as caught:
        greyrig.add("brush_drop", "steps.csv", model)
    assert str(caught.value) == sentence(ran)


def test_nothing_is_written_over(command: Command, here: Path) -> None:
    before = Path("model.toml").read_bytes()
    ran = command("identify", "steps.csv", "--out", "model.toml")
    with pytest.raises(greyrig.UsageError) as caught:
        greyrig.identify("steps.csv", out="model.toml")
    assert str(caught.value) == sentence(ran)
    assert Path("model.toml").read_bytes() == before


def test_words_that_are_none(here: Path) -> None:
    with pytest.raises(greyrig.UsageError, match="choose one of universal, pm-dc"):
        greyrig.identify("steps.csv", kind="magnet")  # pyright: ignore[reportArgumentType]
    with pytest.raises(greyrig.UsageError, match="order from 1 to 8"):
        greyrig.identify("steps.csv", order=9)
    with pytest.raises(greyrig.UsageError, match="positive frequency"):
        greyrig.identify("steps.csv", cutoff_hz=-1.0)
    with pytest.raises(greyrig.UsageError, match="no recording"):
        greyrig.identify([])
    with pytest.raises(greyrig.UsageError, match="not finite"):
        greyrig.identify("steps.csv", fix={"R": float("nan")})
    with pytest.raises(ValueError, match="threads"):
        greyrig.identify("steps.csv", threads=0)
    with pytest.raises(ValueError, match="one voltage"):
        greyrig.predict(["steps.csv", "ramp.csv"], "model.toml")
    with pytest.raises(TypeError):
        greyrig.identify(17)


def test_an_error_goes_to_another_process() -> None:
    with pytest.raises(greyrig.Error) as caught:
        greyrig.load("missing.csv")
    other = pickle.loads(pickle.dumps(caught.value))
    assert type(other) is type(caught.value) and str(other) == str(caught.value) and other.code == 2
