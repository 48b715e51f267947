"""Standing at zero command: edges to a gait that stands, and from it, for any gait graph."""

from dataclasses import replace

from gaitshift.errors import GaitshiftError
from gaitshift.shift.graph import Edge, GaitGraph
from gaitshift.shift.rule import Rule
from gaitshift.shift.statistics.rivals import SpeedCommand

SLOWEST = 0.03
"""A robot that is commanded to move more slowly stands [m/s]; ours: a joystick at rest."""

STOPPING = 60.0
"""Steps at zero command after which a robot stands [counts]; ours: a trot stops within 0.6 s."""

COMMAND = "speed command"
"""Name of the statistic in the graph."""


def with_stand(graph: GaitGraph, gait: str = "stand") -> GaitGraph:
    """The graph with an edge from each gait to `gait` at zero command, and one to its first gait.

    These edges have a higher priority than all others.

    Raises:
        GaitshiftError: the graph has this gait already.
    """
    if gait in graph.gaits:
        raise GaitshiftError(f"a graph must not have the gait '{gait}' yet, got one that has")
    first = 1 + max(edge.priority for edge in graph.edges)
    stops = tuple(
        Edge(
            source=source,
            target=gait,
            statistic=COMMAND,
            rule=Rule(when="below", alpha=SLOWEST, beta=STOPPING),
            priority=first,
        )
        for source in graph.gaits
    )
    goes = Edge(
        source=gait,
        target=graph.start,
        statistic=COMMAND,
        rule=Rule(alpha=SLOWEST, beta=0.0),
    )
    return replace(
        graph,
        statistics={**graph.statistics, COMMAND: SpeedCommand()},
        edges=(*graph.edges, *stops, goes),
    )
