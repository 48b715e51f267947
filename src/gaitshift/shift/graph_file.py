"""Gait graphs as TOML files: the shipped ones by name, others by their path."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from gaitshift.data import Table, known_names, located, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.shift.graph import Edge, GaitGraph
from gaitshift.shift.rule import WHENS, Modulation, Rule
from gaitshift.shift.statistics import STATISTICS, Watched

DEFAULT = "terrain"
"""The default gait graph."""

_FOLDER = Path(__file__).parent / "graphs"
_RULE = ("when", "alpha", "beta", "epsilon", "leak", "hold")


def shipped_graphs() -> tuple[str, ...]:
    """Names of the graphs that come with the package, in alphabetical order."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.toml")))


def load_graph(name_or_path: str | Path = DEFAULT) -> GaitGraph:
    """A shipped graph by its name, or that of a TOML file by its path.

    Raises:
        GaitshiftError: no such graph, or an error in the file; the message names the place.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        if str(name_or_path) not in shipped_graphs():
            hint = "for a file of your own give its path, ending in .toml"
            raise GaitshiftError(
                f"{known_names('graph', str(name_or_path), shipped_graphs())}; {hint}"
            )
        path = _FOLDER / f"{name_or_path}.toml"
    with located(str(path)):
        return _graph(tables_in(path))


def _graph(data: dict[str, object]) -> GaitGraph:
    table = Table(data, keys=("start", "reset", "forget", "statistic", "edge"))
    watched: dict[str, Watched] = {}
    for name, described in table.table("statistic").items():
        with located(f"statistic {name}"):
            watched[name] = _statistic(described)
    edges: list[Edge] = []
    for number, described in enumerate(table.tables("edge"), 1):
        with located(f"edge {number}"):
            edges.append(_edge(described))
    return GaitGraph(
        start=table.text("start"),
        statistics=watched,
        edges=tuple(edges),
        reset=table.flag("reset", default=True),
        forget=table.flag("forget", default=True),
    )


def _statistic(data: object) -> Watched:
    """The statistic that a table describes: its `kind`, and settings of that kind."""
    kind = Table(data, keys=_SETTINGS).text("kind")
    if kind not in STATISTICS:
        raise GaitshiftError(known_names("statistic", kind, tuple(STATISTICS)))
    made = STATISTICS[kind]
    table = Table(data, keys=("kind", *(field.name for field in fields(made))))
    return made(**{f.name: _value(table, f.name, f.default) for f in fields(made)})


_SETTINGS = tuple(
    dict.fromkeys(("kind", *(f.name for made in STATISTICS.values() for f in fields(made))))
)


def _value(table: Table, key: str, default: Any) -> Any:
    """The value of a key, of the type of its default."""
    if not table.has(key):
        return default
    if isinstance(default, str):
        return table.text(key)
    if isinstance(default, int):
        return table.whole(key)
    return table.number(key)


def _edge(data: object) -> Edge:
    table = Table(data, keys=("from", "to", "statistic", "priority", "alpha_over", *_RULE))
    when = table.text("when") if table.has("when") else "above"
    if when not in ("above", "below"):
        raise GaitshiftError(f"'when' must be {' or '.join(WHENS)}, got {when!r}")
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
