"""A machine as text that Mermaid, GitHub and many editors draw."""

from gaitshift.gait.machine import RewardMachine


def mermaid(machine: RewardMachine) -> str:
    """Write the machine as a Mermaid `stateDiagram-v2`: a line a state, a line an edge."""
    lines = ["stateDiagram-v2", "    direction LR"]
    lines += [f"    {s.name} : {s.name}, {s.stance_text()}" for s in machine.states]
    lines += [f"    [*] --> {machine.states[machine.initial].name}"]
    lines += [
        f"    {edge.source} --> {edge.target} : {', '.join(edge.guard.demands())}"
        for edge in machine.edges
    ]
    lines += [f"    {machine.states[u].name} --> [*]" for u in machine.accepting]
    return "\n".join(lines) + "\n"
