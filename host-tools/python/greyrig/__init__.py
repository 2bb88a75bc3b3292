"""Grey-box models of electric motors, from recordings.

The loop: :func:`identify` a model, :func:`compare` it with the measurement, :func:`diagnose` what is missing,
:func:`add` it, and :func:`predict` what the motor does at another voltage::

    import greyrig

    first = greyrig.identify("staircase.csv")
    what = greyrig.diagnose("staircase.csv", first.model)
    better = greyrig.add(what.effects, ["staircase.csv", "ramp.csv"], first.model)
    better.model.save("model.toml")

Functions take recordings, paths, frames of pandas or polars, tables of pyarrow or mappings of arrays, one or several.
Answers are frozen dataclasses whose ``to_dict()`` is the JSON that the command of the same name prints.
"""

from . import fleet
from ._ask import (
    add,
    calibrate,
    check,
    compare,
    diagnose,
    identify,
    monitor,
    predict,
    simulate,
    train,
)
from ._errors import Error, FileError, InputError, InsufficientError, LinkError, UsageError
from ._model import Model, load_model
from ._native import __version__
from ._progress import Progress
from ._recording import Recording, load, recording
from ._results import (
    Addition,
    Alarm,
    Calibration,
    Candidate,
    Check,
    Comparison,
    Detector,
    Diagnosis,
    Fault,
    Finding,
    Identification,
    Judgement,
    Monitoring,
    Parameter,
    PerSignal,
    Prediction,
    Region,
    Result,
    Training,
    Verdict,
)
from ._table import Table

__all__ = [
    "Addition",
    "Alarm",
    "Calibration",
    "Candidate",
    "Check",
    "Comparison",
    "Detector",
    "Diagnosis",
    "Error",
    "Fault",
    "FileError",
    "Finding",
    "Identification",
    "InputError",
    "InsufficientError",
    "Judgement",
    "LinkError",
    "Model",
    "Monitoring",
    "Parameter",
    "PerSignal",
    "Prediction",
    "Progress",
    "Recording",
    "Region",
    "Result",
    "Table",
    "Training",
    "UsageError",
    "Verdict",
    "__version__",
    "add",
    "calibrate",
    "check",
    "compare",
    "diagnose",
    "fleet",
    "identify",
    "load",
    "load_model",
    "monitor",
    "predict",
    "recording",
    "simulate",
    "train",
]
