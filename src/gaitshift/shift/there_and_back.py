"""The paper's two rules as a gait graph with two edges: to the gait for rough ground, and back."""

from dataclasses import replace
from typing import Any

from gaitshift.errors import GaitshiftError
from gaitshift.shift.graph import Edge, GaitGraph
from gaitshift.shift.rule import Modulation, Rule
from gaitshift.shift.statistics import Watched

NUMBERS = ("alpha", "beta", "leak", "alpha_back", "beta_back", "leak_back", "epsilon", "hold")
"""Numbers that `tuned` changes: three of the way there, three of the way back, two of both."""


def there_and_back(
    statistic: Watched,
    there: Rule,
    back: Rule,
    *,
    statistic_back: Watched | None = None,
    flat: str = "trot",
    rough: str = "bound",
    reset: bool = True,
    forget: bool = True,
    modulation: Modulation | None = None,
) -> GaitGraph:
    """Algorithm 1 (III-E) from the gait `flat` to the gait `rough`, and its reverse (IV-C).

    Args:
        statistic: the statistic on the way there.
        there: rule that ends the gait for flat ground.
        back: rule that ends the gait for rough ground; the paper's counts values below α'.
        statistic_back: the statistic on the way back; None: the same, as in the paper. Ours: the
            best statistic for the start of rough ground need not be the best for its end.
        flat: the gait for flat ground, and at the start.
        rough: the gait for rough ground.
        reset: whether a shift resets the robot's counters.
        forget: whether it resets the statistics as well.
        modulation: how α and α' depend on time or speed.

    Raises:
        GaitshiftError: both gaits are the same.
    """
    if flat == rough:
        raise GaitshiftError(f"the gaits for flat and for rough ground must differ, got '{flat}'")
    watched: dict[str, Watched] = {"ground": statistic}
    if statistic_back is not None:
        watched["level ground"] = statistic_back
    seen = "ground" if statistic_back is None else "level ground"
    ends = ((flat, rough, "ground", there), (rough, flat, seen, back))
    return GaitGraph(
        start=flat,
        statistics=watched,
        edges=tuple(
            Edge(source=source, target=target, statistic=name, rule=rule, modulation=modulation)
            for source, target, name, rule in ends
        ),
        reset=reset,
        forget=forget,
    )


def ways(graph: GaitGraph) -> tuple[Edge, Edge]:
    """The edge there and the edge back of such a graph.

    Raises:
        GaitshiftError: the graph does not have this form.
    """
    if len(graph.edges) == 2 and len(graph.gaits) == 2:
        there, back = sorted(graph.edges, key=lambda edge: edge.source != graph.start)
        if there.source == graph.start and back.target == graph.start:
            return there, back
    raise GaitshiftError(
        f"a graph of two gaits, there and back, is needed, got one of {len(graph.gaits)} gaits and "
        f"{len(graph.edges)} edges"
    )


def between(graph: GaitGraph, *, flat: str, rough: str) -> GaitGraph:
    """The same conditions between other gaits."""
    there, back = ways(graph)
    return there_and_back(
        graph.statistics[there.statistic],
        there.rule,
        back.rule,
        statistic_back=(
            None if there.statistic == back.statistic else graph.statistics[back.statistic]
        ),
        flat=flat,
        rough=rough,
        reset=graph.reset,
        forget=graph.forget,
        modulation=there.modulation,
    )


def tuned(graph: GaitGraph, **numbers: float | None) -> GaitGraph:
    """The graph with some of its `NUMBERS` changed; None leaves one as it is.

    Raises:
        GaitshiftError: a name is unknown, a number is out of range, or the graph does not have two
            edges there and back.
    """
    given: dict[str, Any] = {name: value for name, value in numbers.items() if value is not None}
    unknown = [name for name in given if name not in NUMBERS]
    if unknown:
        raise GaitshiftError(f"unknown number '{unknown[0]}'; numbers are {', '.join(NUMBERS)}")
    if not given:
        return graph
    shared = {name: given[name] for name in ("epsilon", "hold") if name in given}
    edges: list[Edge] = []
    for edge, suffix, way in zip(
        ways(graph), ("", "_back"), ("the way to the rough gait", "the way back"), strict=True
    ):
        own = {n: given[n + suffix] for n in ("alpha", "beta", "leak") if n + suffix in given}
        try:
            edges.append(replace(edge, rule=replace(edge.rule, **own, **shared)))
        except GaitshiftError as error:
            raise GaitshiftError(f"{way}: {error}") from None
    return replace(graph, edges=tuple(edges))


def numbers_of(graph: GaitGraph) -> dict[str, float]:
    """The present values of the numbers that `tuned` changes."""
    there, back = (edge.rule for edge in ways(graph))
    own = {name: getattr(there, name) for name in ("alpha", "beta", "leak", "epsilon", "hold")}
    return own | {f"{name}_back": getattr(back, name) for name in ("alpha", "beta", "leak")}
