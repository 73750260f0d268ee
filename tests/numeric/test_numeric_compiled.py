import numpy as np

from auvdock.numeric.compiled import cache_folders, compiled, compiling


def count_above(values, level):
    count = 0
    for value in values:
        if value > level:
            count += 1
    return count


def test_compiled_equals_plain():
    values = np.random.default_rng(3).normal(size=1000)
    assert compiled(count_above)(values, 0.3) == count_above(values, 0.3) == np.count_nonzero(values > 0.3)


def test_divides_by_zero_as_numpy_does():
    def ratio(one, other):
        return one / other

    assert compiled(ratio)(1.0, 0.0) == np.inf
    assert np.isnan(compiled(ratio)(0.0, 0.0))


def test_compiles_where_no_cache_can_be_kept():
    # Code without a file has no place for one, like a package in a read-only folder of a user without a home.
    space = {}
    exec("def twice(x):\n    return 2 * x", space)
    twice = compiled(space["twice"])
    assert twice(21) == 42
    assert cache_folders(twice) == ()


def test_tells_once_that_it_compiles():
    space = {}
    exec("def twice(x):\n    return 2 * x", space)
    one, other = compiled(space["twice"]), compiled(space["twice"])
    told = []
    with compiling(lambda: told.append("now")):
        assert told == []
        assert (one(21), other(21)) == (42, 42)
        assert told == ["now"]
    third = compiled(space["twice"])
    with compiling(lambda: told.append("again")):
        assert one(3) == 6
        assert told == ["now"]
        assert third(3) == 6
    assert told == ["now", "again"]
