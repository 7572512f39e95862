"""Series of the cells of loops: the rows of the first one, then those of all."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from qddot.codegen.kernel import Kernel
from qddot.codegen.recurrences import Form, Recurrences, added, alone
from qddot.codegen.rewrite import Names


def with_rates(kernel: Kernel, rates: Mapping[Any, Any], names: Names) -> tuple[Kernel, dict[Any, Any]]:
    """A kernel with what stands for the rates of what stands for something in its loops, and which rate is whose."""
    loops, found = [], {}
    for loop in kernel.loops:
        standing = dict(loop.symbols)
        by_column = {column: symbol for symbol, column in standing.items()}
        for symbol, column in loop.symbols.items():
            if all(each in rates for each in column):
                of_rates = tuple(rates[each] for each in column)
                if of_rates not in by_column:
                    by_column[of_rates] = names.fresh(f"rate_of_{symbol}")
                    standing[by_column[of_rates]] = of_rates
                found[symbol] = by_column[of_rates]
        loops.append(replace(loop, symbols=standing))
    return replace(kernel, loops=tuple(loops)), found


class Cells:
    """The rows of a table that belong to loops. names: what the nodes of cells must not be called."""

    def __init__(self, kernel: Kernel, names: Names) -> None:
        self._kernel = kernel
        self._names = names
        self._columns = {str(symbol): column for loop in kernel.loops for symbol, column in loop.symbols.items()}
        self._homes = {str(symbol): k for k, loop in enumerate(kernel.loops) for symbol in loop.symbols}
        self._bases: dict[str, str] = {}

    def write(self, table: Recurrences, writes: dict[tuple[str, tuple[int, ...]], Form]) -> None:
        """Add what the loops write to what is written, and put the rows of all cells in the place of the first's."""
        forms = [(slot, table.form(value)) for slot, value in self._kernel.writes if slot.loop is not None]
        nodes = [(slot, table.linear(form)) for slot, form in forms]
        self._find_homes(table)
        whole = [(slot, node) for slot, node in nodes if slot.argument in self._kernel.arrays and slot.index == (0,)]
        self._bases |= {
            node: slot.argument for slot, node in whole if node in self._homes.keys() - self._columns.keys()
        }
        rows = dict(table.rows)
        table.rows.clear()
        for name, row in rows.items():
            home = self._homes.get(name)
            for cell in range(self._kernel.loops[home].count) if home is not None else (0,):
                table.rows[self._of_cell(name, cell)] = tuple(self._of_cell(word, cell) for word in row)
        for slot, node in nodes:
            for cell, index in enumerate(self._kernel.indices(slot)):
                form = alone(self._of_cell(node, cell))
                written = writes.get((slot.argument, index), {}) if slot.adds else {}
                writes[slot.argument, index] = added([written, form])
        for symbol, slot in self._kernel.kept.items():
            node = table.linear(writes.pop(slot.item))
            if node != str(symbol):
                table.rows[str(symbol)] = ("linear", "1", node)

    def _find_homes(self, table: Recurrences) -> None:
        """Which rows belong to loops: those made of what does; some stand before what they are made of."""
        before = -1
        while len(self._homes) > before:
            before = len(self._homes)
            for name, row in table.rows.items():
                homes = (self._homes[part] for word in row for part in _parts(word) if part in self._homes)
                if name not in self._homes and (home := next(homes, None)) is not None:
                    self._homes[name] = home

    def _of_cell(self, word: str, cell: int) -> str:
        """A word of a row, a node or a factor, as it is in one of the cells."""
        if not self._homes.keys() & set(_parts(word)):
            return word
        sign = "-" if word.startswith("-") else ""
        return sign + "*".join(self._named(part, cell) for part in _parts(word))

    def _named(self, part: str, cell: int) -> str:
        if part in self._columns:
            return str(self._columns[part][cell])
        return f"{self._base(part)}_{cell + 1}" if part in self._homes else part

    def _base(self, node: str) -> str:
        """What the nodes of all cells are called that stand where this one stands in the first."""
        if node not in self._bases:
            count, base = self._kernel.loops[self._homes[node]].count, node
            while any(f"{base}_{cell + 1}" in self._names for cell in range(count)):
                base = f"{base}_"
            self._bases[node] = base
        return self._bases[node]


def _parts(word: str) -> Iterator[str]:
    return iter(word.removeprefix("-").split("*"))
