"""Rows of numbers with names: declared once as a dataclass, read by name in compiled loops and outside.

Numba knows no dataclasses, but it knows structured arrays. So a record is a dataclass whose fields are numbers, truth
values, records or arrays of a fixed shape, and `Records` is a NumPy array of such rows:

    @dataclass(frozen=True)
    class Lamp(Record):
        '''A lamp as the camera sees it.'''

        place_m: Annotated[Array, 3]
        intensity_w_sr: float

    @compiled
    def brightest(lamps: Records[Lamp]) -> float:
        best = 0.0
        for i in range(len(lamps)):
            best = max(best, lamps[i].intensity_w_sr)
        return best

    brightest(Lamp.table([Lamp(np.zeros(3), 1.0)]))

A compiled function called from Python takes arrays of records, also where there is only one: a single row costs four
times as much to hand over. Within compiled code single rows are handed on; what is written to their fields is written
to the array.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Self, TypeVar, get_args, get_type_hints

import numpy as np

__all__ = ["Record", "Records", "new_rows"]

_R = TypeVar("_R", bound="Record")

new_rows: Any = np.zeros
"""`numpy.zeros`, by which kernels make records: `lamps: Records[Lamp] = new_rows(3, dtype=_LAMP)` with the global
`_LAMP = Lamp.dtype()`. Type checkers take what it gives for records."""

if TYPE_CHECKING:

    class Records(Sequence[_R]):
        """A NumPy array (n,) of records, as type checkers see it: indexed by row, rows read by name."""

        @typing.overload
        def __getitem__(self, index: int) -> _R: ...
        @typing.overload
        def __getitem__(self, index: slice | np.ndarray[Any, Any]) -> Records[_R]: ...
        @typing.overload
        def __getitem__(self, index: str) -> Any: ...  # noqa: ANN401 - of numbers, or of records again
        def __getitem__(self, index: int | slice | np.ndarray[Any, Any] | str) -> Any:
            """A row, an array of some rows, or the array of one field in all of them."""

        def __setitem__(self, index: int | slice | str, value: object) -> None:
            """Put numbers there."""

        def __len__(self) -> int:
            """How many rows."""
            return 0

        def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:  # noqa: ANN401
            """The array, as NumPy's own functions take it."""
            return np.empty(0)

        def copy(self) -> Records[_R]:
            """An array of its own with the same rows."""
            return self

        def tobytes(self) -> bytes:
            """The rows' bytes."""
            return b""

        def tolist(self) -> list[Any]:
            """The rows as tuples."""
            return []

else:

    class Records(np.ndarray):
        """A NumPy array (n,) of records; a name for annotations, arrays of it are plain `numpy.ndarray`."""


class Record:
    """Base of records: how a dataclass of numbers becomes a row of a NumPy array and is read from it again.

    What compiled code only reads is a frozen dataclass. One whose numbers it advances in place is not frozen, so that
    type checkers let it.
    """

    @classmethod
    def dtype(cls) -> np.dtype[np.void]:
        """The type of a row, its fields in the order and by the names of the dataclass.

        Raises:
            TypeError: a field that is neither a number, a truth value, a record nor an array of a fixed shape.
        """
        return _dtype(cls)

    @classmethod
    def zeros(cls, count: int = 1) -> Records[Self]:
        """An array of `count` rows with 0 and False everywhere."""
        return typing.cast("Records[Self]", np.zeros(count, dtype=_dtype(cls)))

    @classmethod
    def table(cls, rows: Iterable[Self]) -> Records[Self]:
        """An array with these rows.

        Raises:
            ValueError: an array of another shape than is declared.
        """
        given = tuple(rows)
        made = cls.zeros(len(given))
        for index, row in enumerate(given):
            row.write(made, index)
        return made

    def packed(self) -> Records[Self]:
        """An array of one row, this one."""
        return self.table((self,))

    def write(self, rows: Records[Self], index: int = 0) -> None:
        """Put this record into row `index` of an array.

        Raises:
            ValueError: an array of another shape than is declared.
        """
        row: Any = rows[index]
        for name in _names(type(self)):
            value, shape = getattr(self, name), row.dtype[name].shape
            if isinstance(value, Record):
                value.write(rows[name], index)  # type: ignore[arg-type]
            elif np.shape(value) == shape:
                row[name] = value
            else:
                raise ValueError(f"{type(self).__name__}.{name} has shape {np.shape(value)}, declared is {shape}")

    @classmethod
    def read(cls, rows: Records[Self], index: int = 0) -> Self:
        """Row `index` of an array as a dataclass; its arrays are views of the row, its numbers are copies."""
        row: Any = rows[index]
        values: list[Any] = []
        for name, hint in _hints(cls).items():
            if isinstance(hint, type) and issubclass(hint, Record):
                values.append(hint.read(typing.cast("Records[Any]", rows[name]), index))
            else:
                values.append(row[name] if row.dtype[name].shape else row[name].item())
        return cls(*values)


@cache
def _hints(cls: type[Record]) -> dict[str, Any]:
    return get_type_hints(cls, include_extras=True)


@cache
def _names(cls: type[Record]) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(typing.cast(Any, cls)))


@cache
def _dtype(cls: type[Record]) -> np.dtype[np.void]:
    fields: list[tuple[Any, ...]] = []
    for name, hint in _hints(cls).items():
        if hint in (float, int, bool):
            fields.append((name, np.dtype(hint)))
        elif isinstance(hint, type) and issubclass(hint, Record):
            fields.append((name, _dtype(hint)))
        else:
            base, *shape = get_args(hint) or (hint,)
            if not shape or not all(isinstance(size, int) for size in shape):
                raise TypeError(f"{cls.__name__}.{name} of type {hint} has no fixed shape; write Annotated[Array, 3]")
            kind = get_args(get_args(base)[1])[0] if get_args(base) else np.float64
            fields.append((name, np.dtype(kind), tuple(shape)))
    return np.dtype(fields, align=True)
