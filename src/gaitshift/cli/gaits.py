"""`gaitshift gaits`: lists the gaits and draws their machines."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import tyro

from gaitshift.cli.output import check_folder, emit_json, say
from gaitshift.data import tables_in
from gaitshift.whole_file import write_text

_PACKAGE = Path(__file__).parents[1]
_GAITS, _POLICIES = _PACKAGE / "gait" / "gaits", _PACKAGE / "control" / "policies"


@dataclass(frozen=True, kw_only=True)
class Gaits:
    """List the gaits, print the machine of one as a Mermaid diagram, or draw the machines."""

    gait: Annotated[str | None, tyro.conf.Positional] = None
    """Name of a gait or a machine file (.toml); by default all shipped gaits."""
    graph: str = ""
    """Gait graph to check and print as Mermaid: a shipped graph or a .toml file."""
    out: Path | None = None
    """Draw each machine as a picture and a Mermaid file into this folder."""
    overwrite: bool = False
    """Replace earlier drawings in the folder."""
    json: bool = False
    """One JSON object on stdout: the machines."""

    def run(self) -> None:
        """Prints, and draws."""
        if self.graph:
            self._print_graph()
        elif self.gait is None and self.out is None and not self.json:
            for file in sorted(_GAITS.glob("*.toml")):
                print(_line(file))
        else:
            self._show_machines()

    def _print_graph(self) -> None:
        from gaitshift.shift import load_graph

        graph = load_graph(self.graph)
        drawn = graph.mermaid()
        emit_json({"gaits": graph.gaits, "mermaid": drawn}) if self.json else print(drawn)

    def _show_machines(self) -> None:
        from gaitshift.gait import draw, gaits, mermaid

        names = gaits.names() if self.gait is None else (self.gait,)
        machines = [gaits.load(name) for name in names]
        files = tuple(f"{m.name}{ending}" for m in machines for ending in (".png", ".mmd"))
        if self.out is not None:
            check_folder(self.out, overwrite=self.overwrite, ours=files)
            self.out.mkdir(parents=True, exist_ok=True)
        if self.json:
            emit_json({machine.name: machine.to_dict() for machine in machines})
        elif self.gait is not None:
            print(mermaid(machines[0]))
        if self.out is not None:
            for machine in machines:
                draw(machine, self.out / f"{machine.name}.png")
                write_text(self.out / f"{machine.name}.mmd", mermaid(machine) + "\n")
            say(f"drawings in {self.out}: {', '.join(files)}")


def _line(file: Path) -> str:
    """A line of the list, from a shipped file as it is: NumPy takes longer to import than this."""
    gait = cast(dict[str, Any], tables_in(file))
    cycle = " → ".join(state["name"] for state in gait["state"])
    has_policy = (_POLICIES / f"{file.stem}.onnx").is_file()
    shipped = "policy shipped" if has_policy else "no policy shipped"
    return f"{gait['name']:<10} {cycle:<24} {shipped:<18} {gait['description']}"
