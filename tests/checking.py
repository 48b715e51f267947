"""Shapes and types that gaitshift annotates, checked in a sample of calls while tests run.

To check a call costs more than most of the calls themselves. A function's first calls show what its
callers hand it; the sample of later ones shows what comes up in a long run.
"""

import functools
import inspect
import typing
from dataclasses import is_dataclass
from typing import Any, Self, get_args

import jaxtyping
from beartype import BeartypeConf, FrozenDict, beartype
from jaxtyping import install_import_hook

check_types = beartype(
    conf=BeartypeConf(is_pep484_tower=True, hint_overrides=FrozenDict({typing.Self: object}))
)
"""beartype that takes an int for a float, as type checkers do (PEP 484).

It knows `Self` where it decorates whole classes alone, so that here anything may stand for it.
"""

FIRST, EVERY = 5, 101
"""ours: of each function's calls in a test, the first 5 are checked and then one in 101.

A check costs up to a millisecond: 50 and one in 20 makes a demonstration 2.7 times as slow. Of a
nested function only the first calls are checked: it is made anew by every call of the function
around it, and its check would be compiled anew as well.
"""

_calls = {}


def install():
    """Before anything of gaitshift is imported: its annotations then hold whenever a test runs."""
    whole = jaxtyping.jaxtyped

    def jaxtyped(*, typechecker):
        check = whole(typechecker=typechecker)

        def decorated(thing):
            if inspect.isfunction(thing):
                return _sampled(thing, check)
            if is_dataclass(thing) and not hasattr(thing.__init__, "__wrapped__"):
                thing.__init__ = _sampled(thing.__init__, check)
            return thing

        return decorated

    jaxtyping.jaxtyped = jaxtyped
    install_import_hook("gaitshift", "checking.check_types")


def begin_test():
    """Counts calls anew."""
    _calls.clear()


def _sampled(plain, check):
    key = id(plain.__code__)  # the same for all that a nested `def` makes
    is_nested = "<locals>" in plain.__qualname__
    checked = None

    @functools.wraps(plain)
    def call(*args, **kwargs):
        nonlocal checked
        count = _calls[key] = _calls.get(key, 0) + 1
        if count > FIRST and (is_nested or count % EVERY):
            return plain(*args, **kwargs)
        checked = checked or check(_of_any_class(plain))
        return checked(*args, **kwargs)

    return call


def _of_any_class(function):
    """The function with Any where it says Self: beartype sees methods without their class."""
    hints = function.__annotations__
    function.__annotations__ = {n: Any if _says_self(h) else h for n, h in hints.items()}
    return function


def _says_self(hint):
    return hint is Self or any(map(_says_self, get_args(hint)))
