"""Who is told how far work is: nobody, a function, or a bar."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Generator
from typing import Any, TypeAlias

from tqdm import TqdmWarning

with warnings.catch_warnings():
    # Without ipywidgets the bar is one of text, which is all that the warning says.
    warnings.simplefilter("ignore", TqdmWarning)
    from tqdm.auto import tqdm as bar_of

Progress: TypeAlias = Callable[[str, "float | None"], object]
"""Called with what is being done, and the part of it that is done (0 to 1, or ``None``)."""

_DELAY_S = 0.5
"""Work that is done by then shows no bar."""


def _in_notebook() -> bool:
    ipython: Any = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _is_watched() -> bool:
    return _in_notebook() or (sys.stderr is not None and sys.stderr.isatty())


@contextlib.contextmanager
def watching(progress: bool | Progress | None, threads: int | None) -> Generator[dict[str, Any], None, None]:
    """What the native side is given: ``True`` is a bar, ``None`` one where somebody can see it."""
    if threads is not None and threads < 1:
        raise ValueError(f"{threads} threads cannot work; give 1 or more, or None for all processors")
    if progress is None:
        progress = _is_watched()
    if progress is False or callable(progress):
        yield {"progress": progress or None, "threads": threads}
        return
    bar: Any = bar_of(
        total=1.0,
        leave=False,
        delay=_DELAY_S,
        bar_format="{desc} [{bar:30}] {percentage:3.0f} %  {elapsed}",
    )
    try:

        def shown(doing: str, fraction: float | None) -> None:
            bar.set_description_str(doing, refresh=False)
            # A step that begins anew goes back.
            bar.n = fraction or 0.0
            bar.update(0)
            bar.refresh()

        yield {"progress": shown, "threads": threads}
    finally:
        bar.close()
