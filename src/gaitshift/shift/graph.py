"""The gait graph: gaits, and the conditions on the ways between them, as data."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from gaitshift.data import Table, known_names, located, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.shift.condition import Condition
from gaitshift.shift.modulation import Modulation
from gaitshift.shift.named import statistic
from gaitshift.shift.rule import Rule
from gaitshift.shift.statistic import AnyStatistic

_FOLDER = Path(__file__).parent / "graphs"
_RULE = ("when", "alpha", "beta", "epsilon", "leak", "hold")


@dataclass(frozen=True, kw_only=True)
class Edge:
    """A way from one gait to another."""

    source: str
    """The gait it leaves."""
    target: str
    """The gait it leads to."""
    statistic: str
    """Name, in the graph, of what its rule watches."""
    rule: Rule
    """When it is taken."""
    priority: int = 0
    """Of two edges that fire in the same step the one with the higher priority is taken."""
    modulation: Modulation | None = None
    """How α follows time or speed; None: not at all."""

    @property
    def name(self) -> str:
        """As errors call it."""
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True, kw_only=True)
class GaitGraph:
    """Gaits as nodes, conditions on the edges between them; checked when it is made.

    Raises:
        GaitshiftError: no edges; an edge to its own gait; a gait that cannot be reached; two edges
            of one gait that could fire in the same step; a statistic that is not there.
    """

    start: str
    """The gait at the beginning."""
    statistics: Mapping[str, AnyStatistic]
    """What is watched, by name."""
    edges: tuple[Edge, ...]
    """The ways."""
    reset: bool = True
    """Whether a robot that shifts begins anew: counters at 0, nothing remembered of the ground."""

    def __post_init__(self) -> None:
        if not self.edges:
            raise GaitshiftError("a gait graph must have at least one edge, got none")
        for edge in self.edges:
            if edge.source == edge.target:
                raise GaitshiftError(
                    f"edge {edge.name}: source and target must be different gaits, got "
                    f"{edge.source!r} for both"
                )
            if edge.statistic not in self.statistics:
                known = tuple(self.statistics)
                raise GaitshiftError(
                    f"edge {edge.name}: {known_names('statistic', edge.statistic, known)}"
                )
        for a, b in combinations(self.edges, 2):
            if a.source == b.source and a.priority == b.priority:
                raise GaitshiftError(
                    f"edges {a.name} and {b.name} leave the same gait with the same priority "
                    f"{a.priority}; priorities must differ"
                )
        self._check_reach()

    def _check_reach(self) -> None:
        reached = {self.start}
        while more := {e.target for e in self.edges if e.source in reached} - reached:
            reached |= more
        lost = [gait for gait in self.gaits if gait not in reached]
        if lost:
            raise GaitshiftError(
                f"no edges lead from the start gait '{self.start}' to the gait '{lost[0]}'"
            )

    @property
    def gaits(self) -> tuple[str, ...]:
        """The gaits, each once, the first one first."""
        ends = (gait for edge in self.edges for gait in (edge.source, edge.target))
        return tuple(dict.fromkeys((self.start, *ends)))

    @classmethod
    def of(cls, condition: Condition, *, flat: str, rough: str) -> "GaitGraph":
        """The paper's two gaits: one condition, the way there and the way back."""
        if flat == rough:
            raise GaitshiftError(
                f"the gaits for flat and rough ground must differ, got '{flat}' for both"
            )
        watched: dict[str, AnyStatistic] = {"ground": condition.statistic}
        back = "ground"
        if condition.statistic_back is not None:
            back = "level ground"
            watched[back] = condition.statistic_back
        ends = (
            (flat, rough, "ground", condition.rough),
            (rough, flat, back, condition.flat),
        )
        return cls(
            start=flat,
            statistics=watched,
            edges=tuple(
                Edge(
                    source=source,
                    target=target,
                    statistic=name,
                    rule=rule,
                    modulation=condition.modulation,
                )
                for source, target, name, rule in ends
            ),
            reset=condition.reset,
        )

    @classmethod
    def load(cls, name_or_path: str | Path) -> "GaitGraph":
        """A shipped graph by its name, or that of a TOML file by its path.

        Raises:
            GaitshiftError: no such graph, or a fault in the file, which is named with its place.
        """
        path = Path(name_or_path)
        if path.suffix != ".toml":
            known = tuple(sorted(file.stem for file in _FOLDER.glob("*.toml")))
            if str(name_or_path) not in known:
                hint = "or give the path of a .toml file"
                raise GaitshiftError(f"{known_names('graph', str(name_or_path), known)}; {hint}")
            path = _FOLDER / f"{name_or_path}.toml"
        with located(str(path)):
            return _read(tables_in(path))

    def mermaid(self) -> str:
        """As a Mermaid `stateDiagram-v2`: a line an edge, with its rule."""
        lines = ["stateDiagram-v2", "    direction LR", f"    [*] --> {self.start}"]
        for edge in self.edges:
            unit = self.statistics[edge.statistic].unit
            rule = f"{edge.statistic} {edge.rule.when} {edge.rule.alpha:g} {unit}".rstrip()
            lines.append(f"    {edge.source} --> {edge.target} : {rule}, k over {edge.rule.beta:g}")
        return "\n".join(lines) + "\n"


def _read(data: dict[str, object]) -> GaitGraph:
    table = Table(data, keys=("start", "reset", "statistic", "edge"))
    watched: dict[str, AnyStatistic] = {}
    for name, described in table.table("statistic").items():
        with located(f"statistic {name}"):
            watched[name] = statistic(described)
    edges: list[Edge] = []
    for number, described in enumerate(table.tables("edge"), 1):
        with located(f"edge {number}"):
            edges.append(_edge(described))
    return GaitGraph(
        start=table.text("start"),
        statistics=watched,
        edges=tuple(edges),
        reset=table.flag("reset", default=True),
    )


def _edge(data: object) -> Edge:
    table = Table(data, keys=("from", "to", "statistic", "priority", "alpha_over", *_RULE))
    when = table.text("when") if table.has("when") else "above"
    if when not in ("above", "below"):
        raise GaitshiftError(f"'when' must be above or below, got {when!r}")
    return Edge(
        source=table.text("from"),
        target=table.text("to"),
        statistic=table.text("statistic"),
        priority=table.whole("priority", default=0),
        modulation=_modulation(table.get("alpha_over")) if table.has("alpha_over") else None,
        rule=Rule(
            when=when,
            alpha=table.number("alpha"),
            beta=table.number("beta"),
            epsilon=table.number("epsilon", default=1.0),
            leak=table.number("leak", default=0.0),
            hold=table.number("hold", default=0.0),
        ),
    )


def _modulation(data: object) -> Modulation:
    with located("alpha_over"):
        table = Table(data, keys=("of", "points"))
        of = table.text("of")
        if of not in ("speed", "time"):
            raise GaitshiftError(f"'of' must be speed or time, got {of!r}")
        return Modulation(of=of, points=table.points("points"))
