"""Types of several results: tuples with the names of the function's results."""

from collections import namedtuple
from functools import lru_cache


class NamedResults:
    """What named tuples of results have in common."""

    __slots__ = ()

    def __reduce__(self):
        return (_result, (self.function, self._fields, tuple(self)))


@lru_cache(maxsize=None)
def result_type(function, names):
    """The type of the results of a function with these names."""
    title = "".join(word.capitalize() for word in function.split("_"))
    base = namedtuple(title, names)
    members = {"__slots__": (), "__doc__": f"Results of `{function}`: {', '.join(names)}.", "function": function}
    return type(title, (NamedResults, base), members)


def _result(function, names, values):
    return result_type(function, names)(*values)


def signature(inputs):
    """What `inspect.signature` says of a function with these inputs."""
    from inspect import Parameter, Signature

    by_either = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in inputs]
    by_name = [Parameter("out", Parameter.KEYWORD_ONLY, default=None), Parameter("threads", Parameter.KEYWORD_ONLY, default=1)]
    return Signature(by_either + by_name)
