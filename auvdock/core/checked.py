"""Settings that refuse what their annotations do not allow, however they are made."""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from auvdock.core.magnitudes import LEAST, greatest_of, unit_of
from auvdock.core.reader import bare_type, hints_of, read_value

__all__ = ["Checked"]


class Checked:
    """Base of every frozen dataclass of settings: each field is of its type and within its limits, or none is made.

    A field's annotation says its type (`core.reader`) and limits (`core.limits`), and a `Literal` its names. A class'
    own `__post_init__` only relates fields to each other; it runs after the annotations have been checked. As in a
    file, a whole number becomes a float, a list a tuple and a table a dataclass where the annotation wants one.

    Raises:
        ConfigError: a field whose annotation refuses its value, when an instance is made.
    """

    def __post_init__(self) -> None:
        """Read each field by its annotation."""
        for name, hint, kind, least, greatest in _fields_of(type(self)):
            value = getattr(self, name)
            if type(value) is not kind or (least is not None and not least <= value <= greatest):
                object.__setattr__(self, name, read_value(hint, value, name))

    def __init_subclass__(cls) -> None:
        """Put that check before the class' own `__post_init__`."""
        relate = cls.__dict__.get("__post_init__")
        if relate is None:
            return

        def check(self: Checked) -> None:
            Checked.__post_init__(self)
            relate(self)

        cls.__post_init__ = check


class _Field(NamedTuple):
    """A field and which of its values need no second look: of just this type and, as a number, in this range."""

    name: str
    hint: Any
    kind: Any
    least: float | None = None
    greatest: float = math.inf


@cache
def _fields_of(cls: type) -> tuple[_Field, ...]:
    return tuple(_field(name, hint) for name, hint in hints_of(cls).items())


def _field(name: str, hint: Any) -> _Field:  # noqa: ANN401
    kind = bare_type(hint)
    if kind not in (int, float):
        return _Field(name, hint, hint)
    limits = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    greatest = greatest_of(name, kind is int)
    least = LEAST if unit_of(name, kind()) else -greatest  # with a unit, 0 and negative ones get their second look
    lows, highs = [limit.least for limit in limits], [limit.greatest for limit in limits]
    return _Field(name, hint, kind, max([least, *lows]), min([greatest, *highs]))
