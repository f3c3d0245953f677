"""The function that makes pickled objects anew, from the call that first made them."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

from linelit import _linelit


def make(by: str, arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """Call a function of the compiled part by its name, and return the object that it makes."""
    return attrgetter(by)(_linelit)(*arguments, **options)
