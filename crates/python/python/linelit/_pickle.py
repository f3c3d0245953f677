"""Objects of other processes and of files, made again of what they were made of."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

from linelit import _linelit


def make(by: str, arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """Return what a function of the compiled part makes."""
    return attrgetter(by)(_linelit)(*arguments, **options)
