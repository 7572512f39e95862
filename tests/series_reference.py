"""A table of recurrences evaluated slowly, with mpmath's numbers, by the definitions of its rules: the truth."""

import mpmath

from qddot.runner.machine.recurrences import ONE, TIME


def coefficients(table, constants, given, order, t=0.0, sides=None, sense=1):
    """Name -> coefficients 0 to order - 1 of all nodes, to `order` of the states. given: state or input -> its values.

    Nodes of an order are computed when what they need is known; unknowns from the equations, which are linear in them.
    """
    return _Reference(table, constants, given, t, sides or {}, sense).up_to(order)


class _UnknownError(Exception):
    pass


class _Reference:
    def __init__(self, table, constants, given, t, sides, sense):
        self.table, self.constants, self.sides, self.sense = table, constants, sides, sense
        self.t = mpmath.mpf(t)
        self.given = {name: value if isinstance(value, list) else [value] for name, value in given.items()}
        self.series = {name: [] for name in (*table.nodes, *table.inputs)}

    def up_to(self, order):
        for k in range(order):
            self._order(k)
        for state in self.table.states:
            self.series[state].append(self._integral(self.table.nodes[state], order))
        for name in self.table.inputs:
            self.series[name] = [self.at(name, k) for k in range(order)]
        return self.series

    def factor(self, factor):
        value = mpmath.mpf(factor.number)
        for place in factor.constants:
            value *= self.constants[place]
        return value

    def at(self, name, k):
        """Coefficient k; _UnknownError where it is not known."""
        if name == ONE:
            return mpmath.mpf(k == 0)
        if name == TIME:
            return self.t if k == 0 else mpmath.mpf(self.sense if k == 1 else 0)
        if name in self.table.inputs:
            values = self.given[name]
            return mpmath.mpf(values[k]) if k < len(values) else mpmath.mpf(0)
        if k >= len(self.series[name]):
            raise _UnknownError
        return self.series[name][k]

    def _order(self, k):
        names = self.table.unknowns
        self._round(k, dict.fromkeys(names, mpmath.mpf(0)))
        if names:
            rights = [self.at(self.table.nodes[name].arguments[0], k) for name in names]
            matrix = mpmath.matrix(len(names), len(names))
            for i, name in enumerate(names):
                for other, factor, entry in self.table.nodes[name].entries:
                    matrix[i, names.index(other)] = self.factor(factor) * self.at(entry, 0)
            solution = mpmath.lu_solve(matrix, mpmath.matrix(rights))
            self._round(k, dict(zip(names, solution, strict=True)))

    def _round(self, k, unknowns):
        for name in self.table.nodes:
            del self.series[name][k:]
        for name, value in unknowns.items():
            self.series[name].append(value)
        waiting = [name for name in self.table.nodes if name not in unknowns]
        while waiting:
            left = []
            for name in waiting:
                try:
                    self.series[name].append(self._value(self.table.nodes[name], k))
                except _UnknownError:
                    left.append(name)
            assert len(left) < len(waiting), left
            waiting = left

    def _value(self, node, k):
        return getattr(self, f"_{node.rule}", self._function)(node, k)

    def _sum(self, a, b, k, start=0, stop=None, weight=lambda j: 1):
        stop = k + 1 if stop is None else stop
        return sum((weight(j) * self.at(a, j) * self.at(b, k - j) for j in range(start, stop)), mpmath.mpf(0))

    def _integral(self, node, k):
        if k == 0:
            return mpmath.mpf(self.given[node.name][0]) if node.start is None else self._value(node.start, 0)
        return self.sense * self.factor(node.factors[0]) * self.at(node.arguments[0], k - 1) / k

    def _linear(self, node, k):
        values = [self.at(name, k) for name in node.arguments]
        return sum((self.factor(f) * x for f, x in zip(node.factors, values, strict=True)), mpmath.mpf(0))

    def _product(self, node, k):
        return self._sum(*node.arguments, k)

    def _lagging(self, node, k):
        return self._sum(*node.arguments, k, start=1)

    def _rate(self, node, k):
        g, v, a = node.arguments
        following = self._integral(self.table.nodes[g], k + 1)
        known = self._sum(g, v, k + 1, start=1, stop=k + 1) + following * self.at(v, 0)
        return self.sense * (k + 1) * known + self.at(g, 0) * self.at(a, k)

    def _side(self, node, k):
        return mpmath.mpf(self.sides[node.name] if k == 0 else 0)

    def _where(self, node, k):
        side, yes, no = node.arguments
        return self.at(yes if self.at(side, 0) > 0.5 else no, k)

    def _quotient(self, node, k):
        a, b = node.arguments
        return (self.at(a, k) - self._sum(b, node.name, k, start=1)) / self.at(b, 0)

    def _power(self, node, k):
        x, exponent = node.arguments[0], self.factor(node.factors[0])
        if k == 0:
            return self.at(x, 0) ** exponent
        return self._sum(x, node.name, k, start=1, weight=lambda j: (exponent + 1) * j - k) / k / self.at(x, 0)

    def _function(self, node, k):
        count = 2 if node.rule == "atan2" else 1
        names = node.arguments
        values = [self.at(name, 0) for name in names[:count]]
        if k == 0:
            return getattr(mpmath, node.rule)(*values)
        parts = [self._sum(names[i], names[count + i], k, start=1, weight=lambda j: j) for i in range(count)]
        return sum(self.factor(f) * part for f, part in zip(node.factors, parts, strict=True)) / k
