"""`gaitshift gaits`: lists the gaits and draws their machines."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift.cli.output import check_folder, emit_json, say
from gaitshift.control import policy
from gaitshift.gait import RewardMachine, draw, gaits, mermaid
from gaitshift.shift import load_graph
from gaitshift.whole_file import write_text


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
            graph = load_graph(self.graph)
            drawn = graph.mermaid()
            emit_json({"gaits": graph.gaits, "mermaid": drawn}) if self.json else print(drawn)
            return
        names = gaits.names() if self.gait is None else (self.gait,)
        machines = [gaits.load(name) for name in names]
        files = tuple(f"{m.name}{ending}" for m in machines for ending in (".png", ".mmd"))
        if self.out is not None:
            check_folder(self.out, overwrite=self.overwrite, ours=files)
            self.out.mkdir(parents=True, exist_ok=True)
        if self.json:
            emit_json({machine.name: machine.to_dict() for machine in machines})
        elif self.gait is None:
            for machine in machines:
                print(_line(machine))
        else:
            print(mermaid(machines[0]))
        if self.out is not None:
            for machine in machines:
                draw(machine, self.out / f"{machine.name}.png")
                write_text(self.out / f"{machine.name}.mmd", mermaid(machine) + "\n")
            say(f"drawings in {self.out}: {', '.join(files)}")


def _line(machine: RewardMachine) -> str:
    cycle = " → ".join(state.name for state in machine.states)
    shipped = "policy shipped" if machine.name in policy.shipped() else "no policy shipped"
    return f"{machine.name:<10} {cycle:<24} {shipped:<18} {machine.description}"
