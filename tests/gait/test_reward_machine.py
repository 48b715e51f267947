"""The batched machine against the paper's tuple, told a second time with sets, loops and ifs."""

import json
from copy import deepcopy
from fractions import Fraction
from itertools import chain, combinations, permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gaitshift.gait import RewardMachine, mermaid
from trot_tables import FEET, TROT, contacts, edited, ints, quick

MIRROR = {"FL": "FR", "FR": "FL", "BL": "BR", "BR": "BL"}
PATTERNS = [set(p) for p in chain.from_iterable(combinations(FEET, n) for n in range(5))]
seeds = st.integers(0, 2**32 - 1)


# The slow machine -------------------------------------------------------------------------------


def suits(transition, down):
    return set(transition["down"]) <= down and not set(transition["up"]) & down


def stance_of(tables, state):
    return {foot for s in tables["state"] if s["name"] == state for foot in s.get("stance", [])}


def slow_step(tables, state, down, steps, dwell=None):
    """(u', changed, bonus) of one robot whose feet `down` touch, after steps in the state."""
    for one in tables["transition"]:
        asked = Fraction(one.get("dwell", tables["dwell"]))
        if dwell is not None:
            asked = asked * dwell / tables["dwell"] if tables["dwell"] else Fraction(dwell)
        if one["from"] == state and suits(one, down) and steps + 1 >= asked:
            return one["to"], True, one.get("bonus", 1.0)
    return state, False, 0.0


@st.composite
def machines(draw_from):
    """Tables of a lawful machine: a ring of stances with free feet here and there, and chords."""
    pick = draw_from
    count = pick(st.integers(2, 5))
    stances = [pick(st.sampled_from(PATTERNS))]
    while len(stances) < count:
        barred = (stances[-1], stances[0]) if len(stances) == count - 1 else (stances[-1],)
        stances.append(pick(st.sampled_from([p for p in PATTERNS if p not in barred])))
    states = [{"name": f"u{i}", "stance": sorted(s)} for i, s in enumerate(stances)]
    ends = [(i, (i + 1) % count) for i in range(count)]
    ends += pick(st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count)), max_size=5))
    transitions = []
    for source, target in ends:
        stance = stances[target] if target < count else pick(st.sampled_from(PATTERNS))
        joined = [t for t in transitions if (t["from"], t["to"]) == (f"u{source}", f"u{target}")]
        if joined:
            stance = pick(st.sampled_from(PATTERNS))
        for freed in (pick(st.sets(st.sampled_from(FEET))), set()):
            one = {
                "from": f"u{source}",
                "to": f"u{target}",
                "down": sorted(stance - freed),
                "up": sorted(set(FEET) - stance - freed),
            }
            rivals = [t for t in transitions if t["from"] == one["from"]]
            clash = any(suits(one, p) and suits(r, p) for p in PATTERNS for r in rivals)
            if source != target and not clash and not suits(one, stances[source]):
                transitions.append(one | pick(EXTRAS))
                break
    if any(t["to"] == f"u{count}" for t in transitions):
        states.append({"name": f"u{count}", "accepting": True})
    dwell = pick(st.integers(0, 6))
    if dwell == 0:  # then a dwell of an edge's own would be lost
        transitions = [t | {"dwell": 0} if "dwell" in t else t for t in transitions]
    tables = TROT | {"dwell": dwell, "state": states, "transition": transitions}
    if pick(st.booleans()):
        least = pick(st.integers(min(1, dwell), dwell))
        tables["dwell_range"] = [least, dwell + pick(st.integers(0, 9))]
        tables |= {"speed": 0.5, "speed_range": [0.25, 0.75]}
    return tables


EXTRAS = st.fixed_dictionaries(
    {},
    optional={
        "dwell": st.integers(0, 8),
        "swing_height": st.sampled_from([0.0, 0.02, 0.05]),
        "bonus": st.sampled_from([0.0, 0.5, 2.0, -1.0]),
    },
)


def random_contacts(tables, rng, steps, robots):
    """Contacts (T, N, 4), half of them the stance of some state."""
    contact = rng.random((steps, robots, 4)) < 0.5
    stances = contacts(*(" ".join(s.get("stance", [])) for s in tables["state"]))
    shown = rng.random((steps, robots)) < 0.5
    contact[shown] = stances[rng.integers(len(stances), size=shown.sum())]
    return contact


@quick
@given(
    tables=machines(),
    seed=seeds,
    dwell=st.none() | st.integers(0, 9) | st.lists(st.integers(0, 9), min_size=4, max_size=4),
)
def test_batched_machine_is_the_slow_machine(tables, seed, dwell):
    machine = RewardMachine.from_dict(tables)
    contact = random_contacts(tables, np.random.default_rng(seed), 40, 4)
    names = [state.name for state in machine.states]
    state, steps = np.zeros(4, dtype=int), np.zeros(4, dtype=int)
    command = np.array(dwell) if isinstance(dwell, list) else dwell
    for t in range(len(contact)):
        told = machine.step(state, contact[t], steps, dwell=command)
        for n in range(4):
            down = {foot for foot, touches in zip(FEET, contact[t, n], strict=True) if touches}
            one = dwell[n] if isinstance(dwell, list) else dwell
            slow = slow_step(tables, names[state[n]], down, steps[n], one)
            assert (names[told.state[n]], told.changed[n], told.bonus[n]) == slow
            edge = machine.edges[told.edge[n]] if told.edge[n] < len(machine.edges) else None
            assert (edge is not None) == told.changed[n]
            assert edge is None or (edge.source, edge.target) == (names[state[n]], slow[0])
        state, steps = told.state, np.where(told.changed, 0, steps + 1)


# Invariances ------------------------------------------------------------------------------------


def one_step(machine, rng, robots=12):
    """Arguments of `step` on random contacts."""
    contact = random_contacts(machine.to_dict(), rng, 1, robots)
    state = rng.integers(len(machine.states), size=robots)
    return state, contact[0], rng.integers(0, 12, size=robots)


@quick
@given(tables=machines(), seed=seeds)
def test_each_robot_is_its_own(tables, seed):
    rng = np.random.default_rng(seed)
    machine = RewardMachine.from_dict(tables)
    arguments = one_step(machine, rng)
    before = deepcopy(arguments)
    together = machine.step(*arguments)
    order = rng.permutation(len(arguments[0]))
    permuted = machine.step(*(a[order] for a in arguments))
    alone = [machine.step(*(a[n : n + 1] for a in arguments)) for n in range(len(order))]
    for i in range(4):
        np.testing.assert_array_equal(permuted[i], together[i][order])
        np.testing.assert_array_equal(np.concatenate([one[i] for one in alone]), together[i])
    for given_array, copy in zip(arguments, before, strict=True):
        np.testing.assert_array_equal(given_array, copy)


@quick
@given(tables=machines(), seed=seeds)
def test_the_mirrored_machine_sees_mirrored_feet_as_the_machine_sees_them(tables, seed):
    machine = RewardMachine.from_dict(tables)
    state, contact, steps = one_step(machine, np.random.default_rng(seed))
    swap = [FEET.index(MIRROR[foot]) for foot in FEET]
    told = machine.step(state, contact, steps)
    mirrored = machine.mirrored().step(state, contact[:, swap], steps)
    for one, other in zip(told, mirrored, strict=True):
        np.testing.assert_array_equal(one, other)
    assert machine.mirrored().mirrored() == machine


def slow_mirrors(tables):
    """All permutations of the states that carry the machine's mirror image onto itself."""
    states, transitions = tables["state"], tables["transition"]
    numbers = {s["name"]: i for i, s in enumerate(states)}
    itself = {foot: foot for foot in FEET}

    def stances(feet):
        return [(s.get("accepting"), {feet[f] for f in s.get("stance", [])}) for s in states]

    def edges(images, feet):
        return {
            (
                *(images[numbers[t[end]]] for end in ("from", "to")),
                *(frozenset(feet[f] for f in t[side]) for side in ("down", "up")),
                t.get("dwell", tables["dwell"]),
                t.get("swing_height", tables["swing_height"]),
                t.get("bonus", 1.0),
            )
            for t in transitions
        }

    plain = stances(itself), edges(range(len(states)), itself)
    for images in permutations(range(len(states))):
        carried = [plain[0][image] for image in images]
        if (carried, edges(images, MIRROR)) == (stances(MIRROR), plain[1]):
            yield images


@st.composite
def nearly_symmetric_machines(draw_from):
    """A ring whose second half mirrors the first, as gaits do, with perhaps one thing changed."""
    half = draw_from(st.lists(st.sampled_from(PATTERNS), min_size=1, max_size=2))
    ring = half + [{MIRROR[foot] for foot in stance} for stance in half]
    assume(all(ring[i] != ring[i - 1] for i in range(len(ring))))
    extras = [draw_from(EXTRAS) for _ in half] * 2
    states = [{"name": f"u{i}", "stance": sorted(s)} for i, s in enumerate(ring)]
    transitions = [
        {
            "from": f"u{i - 1 if i else len(ring) - 1}",
            "to": f"u{i}",
            "down": sorted(stance),
            "up": sorted(set(FEET) - stance),
        }
        | extras[i]
        for i, stance in enumerate(ring)
    ]
    transitions[-1] |= draw_from(st.just({}) | EXTRAS)
    flight = {"from": "u0", "to": "end", "down": [], "up": list(FEET)}
    if draw_from(st.booleans()) and set() not in ring:
        states.append({"name": "end", "accepting": True})
        twin = flight | {"from": f"u{len(half)}"}
        transitions += [flight] if draw_from(st.booleans()) else [flight, twin]
    return TROT | {"state": states, "transition": transitions}


@settings(max_examples=200, deadline=None)
@given(machines() | nearly_symmetric_machines())
def test_mirrored_states_are_those_that_trying_all_permutations_finds(tables):
    found = RewardMachine.from_dict(tables).mirrored_states()
    mirrors = list(slow_mirrors(tables))
    assert found in mirrors if mirrors else found is None


def test_trot_in_the_mirror_is_trot_with_its_states_swapped():
    trot = RewardMachine.from_dict(TROT)
    assert trot.mirrored_states() == (1, 0)
    assert trot.mirrored().states == trot.states[::-1]
    assert trot.mirrored().ideal_phase == (0.5, 0.0, 0.0, 0.5)


def test_a_machine_is_not_its_own_mirror_for_its_guards_alone():
    ways = [
        {"from": "one", "to": "two", "down": ["FR"], "up": ["FL"]},
        {"from": "two", "to": "one", "down": ["FL"], "up": ["FR"]},
    ]
    states = [{"name": "one", "stance": ["FL"]}, {"name": "two", "stance": ["FR", "BL"]}]
    machine = RewardMachine.from_dict(edited(state=states, transition=ways))
    assert machine.mirrored_states() is None
    states[1]["stance"] = ["FR"]
    machine = RewardMachine.from_dict(edited(state=states, transition=ways))
    assert machine.mirrored_states() == (1, 0)


# Trot by hand -----------------------------------------------------------------------------------


@pytest.mark.parametrize("pattern", [" ".join(sorted(p)) for p in PATTERNS])
def test_trot_changes_on_the_other_diagonal_alone(pattern):
    trot = RewardMachine.from_dict(TROT)
    told = trot.step(ints(0, 1), contacts(pattern, pattern), ints(50, 50))
    expected = {"BL FR": [1, 1], "BR FL": [0, 0]}.get(pattern, [0, 1])
    assert told.state.tolist() == expected
    assert told.changed.tolist() == [expected[0] == 1, expected[1] == 0]
    assert told.bonus.tolist() == told.changed.tolist()


def test_feet_that_tap_at_every_step_change_the_trot_once_a_dwell():
    trot = RewardMachine.from_dict(TROT)
    state, steps, changes = ints(0), ints(0), []
    for t in range(1, 101):
        other = contacts("FR BL" if state[0] == 0 else "FL BR")
        state, changed, *_ = trot.step(state, other, steps)
        steps = np.where(changed, 0, steps + 1)
        changes += [t] if changed[0] else []
    assert changes == [20, 40, 60, 80, 100]


def test_dwell_command_takes_the_place_of_the_file_and_keeps_proportions():
    tables = deepcopy(TROT)
    tables["transition"][1]["dwell"] = 10
    machine = RewardMachine.from_dict(tables)
    states, labels = ints(0, 0, 1, 1), contacts("FR BL", "FR BL", "FL BR", "FL BR")
    for dwell, first_open in ((None, (19, 9)), (15, (14, 7)), (ints(8, 8, 8, 8), (7, 3))):
        slow, quick_ = first_open
        steps = ints(slow - 1, slow, quick_ - 1, quick_)
        told = machine.step(states, labels, steps, dwell=dwell)
        assert told.changed.tolist() == [False, True, False, True]


# The cycle --------------------------------------------------------------------------------------

RANGED = TROT | {"dwell_range": [15, 30]}
LIMP = deepcopy(RANGED)
LIMP["transition"][1]["dwell"] = 10
"""A trot that stays half as long on its second diagonal."""


@pytest.mark.parametrize(
    ("tables", "strides"),
    [
        (RANGED, {None: 40, 20: 40, 15: 30, 30: 60, 1: 2, 0: 2}),
        # 17 and half of it, 8.5, rounded up; a state lasts at least the step in which it is left
        (LIMP, {None: 30, 20: 30, 17: 26, 18: 27, 15: 23, 1: 2, 0: 2}),
        (TROT | {"dwell": 0}, {None: 2, 0: 2, 7: 14}),
    ],
)
def test_the_stride_is_the_sum_of_the_dwells_each_rounded_up(tables, strides):
    machine = RewardMachine.from_dict(tables)
    assert {dwell: machine.stride(dwell) for dwell in strides} == strides


@pytest.mark.parametrize(
    ("tables", "dwells"),
    [
        # strides of 30, 32, 34 … 60 steps; of two that are as near the shorter
        (RANGED, {40.0: 20, 33.0: 16, 33.1: 17, 10.0: 15, 59.2: 30, 1e6: 30}),
        # strides of 23, 24, 26, 27, 29, 30, 32 … 45 steps for dwells of 15, 16, 17 …
        (LIMP, {23.4: 15, 25.0: 16, 26.0: 17, 28.2: 19, 45.0: 30}),
        (TROT, {40.0: 20, 10.0: 20, 90.0: 20}),
    ],
)
def test_the_dwell_for_a_stride_is_the_one_in_range_whose_stride_is_nearest(tables, dwells):
    machine = RewardMachine.from_dict(tables)
    told = machine.dwell_for(np.array(list(dwells)))
    assert told.tolist() == list(dwells.values())


@quick
@given(tables=machines(), command=st.integers(0, 9))
def test_feet_that_never_dally_go_once_round_in_a_stride(tables, command):
    machine = RewardMachine.from_dict(tables)
    state, waited, taken, steps = 0, 0, [], 0
    edges = [machine.edges[number] for number in machine.cycle]
    assume(edges[-1].target == machine.states[0].name)
    while len(taken) < len(edges) and steps < 1000:
        label = sorted(machine.edges[machine.cycle[len(taken)]].guard.down)
        told = machine.step(ints(state), contacts(" ".join(label)), ints(waited), dwell=command)
        state, waited = told.state[0], 0 if told.changed[0] else waited + 1
        taken += [machine.states[state].name] if told.changed[0] else []
        steps += 1
    assert taken == [edge.target for edge in edges]
    assert steps == machine.stride(command)


LATE = [
    # dwell of the state 20: on time until step 22, worth nothing from step 32 on
    (RANGED, 0, None, {1: 1.0, 20: 1.0, 22: 1.0, 23: 0.9, 27: 0.5, 32: 0.0, 90: 0.0}),
    (RANGED, 0, 10, {12: 1.0, 13: 0.8, 17: 0.0}),
    # The second diagonal of the limping trot is to last half as long; 15 steps of 30, 8 of 15.
    (LIMP, 1, None, {12: 1.0, 13: 0.8, 17: 0.0}),
    (LIMP, 1, 30, {17: 1.0, 18: 1 - 1 / 7.5, 25: 0.0}),
    (LIMP, 1, 15, {10: 1.0, 11: 0.75, 14: 0.0}),
    (RANGED, 0, 0, {1: 1.0, 500: 1.0}),
]


@pytest.mark.parametrize(("tables", "state", "dwell", "table"), LATE)
def test_a_change_is_punctual_for_two_steps_and_worth_nothing_half_a_dwell_later(
    tables, state, dwell, table
):
    machine = RewardMachine.from_dict(tables)
    waited = np.array(list(table)) - 1  # the step now ending counts
    seen = machine.punctuality(np.full(len(waited), state), waited, dwell)
    np.testing.assert_allclose(seen, list(table.values()), atol=1e-12)


def test_the_cycle_takes_the_way_back_wherever_the_way_to_an_end_stands_in_the_file():
    sink = {"name": "sink", "accepting": True}
    out = {"from": "FR_BL", "to": "sink", "down": [], "up": list(FEET)}
    there, back = TROT["transition"]

    def round_trip(*ways):
        machine = RewardMachine.from_dict(edited(state=[*TROT["state"], sink], transition=[*ways]))
        return machine.cycle, machine.touchdowns, machine.stride()

    assert round_trip(there, back, out) == ((0, 1), (1, 1, 1, 1), 40)
    assert round_trip(back, out, there) == ((2, 0), (1, 1, 1, 1), 40)
    assert round_trip(there, out, back) == ((0, 2), (1, 1, 1, 1), 40)
    assert round_trip(out, there, back) == ((1, 2), (1, 1, 1, 1), 40)


def test_the_cycle_of_a_machine_without_a_way_back_ends_where_the_run_ends():
    """The run ends on its second stance: FR and BL have come down, and nobody comes back."""
    sink = {"name": "sink", "accepting": True}
    out = {"from": "FR_BL", "to": "sink", "down": [], "up": list(FEET)}
    ways = [out, TROT["transition"][0]]
    machine = RewardMachine.from_dict(edited(state=[*TROT["state"], sink], transition=ways))
    assert (machine.cycle, machine.touchdowns) == ((1, 0), (0, 1, 1, 0))


# Feet that have swung ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("swing", "share"),
    [
        ([0.0, 0.03, 0.03, 0.0], 1.0),
        ([0.0, 0.03, 0.015, 0.0], 0.5),
        ([0.0, 0.01, 0.02, 0.0], 1 / 3),
        ([9.0, 0.0, 9.0, 9.0], 0.0),
        ([9.0, 9.0, -0.001, 9.0], 0.0),
        ([0.0, np.inf, np.inf, 0.0], 1.0),
        ([np.nan, 0.06, 0.06, np.nan], 1.0),
    ],
)
def test_the_lowest_of_the_feet_that_land_is_the_share_of_the_swing_height(swing, share):
    trot = RewardMachine.from_dict(TROT)
    told = trot.step(ints(0), contacts("FR BL"), ints(30))
    assert trot.swing_share(told.edge, np.array([swing])).tolist() == [pytest.approx(share)]


def test_no_height_is_asked_for_where_no_foot_lands_or_none_is_told():
    pronk = [
        {"from": "ALL", "to": "NONE", "down": [], "up": [*FEET]},
        {"from": "NONE", "to": "ALL", "down": [*FEET], "up": [], "swing_height": 0.0},
    ]
    states = [{"name": "ALL", "stance": [*FEET]}, {"name": "NONE", "stance": []}]
    machine = RewardMachine.from_dict(TROT | {"state": states, "transition": pronk})
    assert machine.swing_share(ints(0, 1, 2), np.zeros((3, 4))).tolist() == [1.0, 1.0, 1.0]


def test_feet_that_are_expected_stand_now_or_after_the_next_change():
    gallop = [
        {"from": name, "to": after, "down": [after], "up": [f for f in FEET if f != after]}
        for name, after in (("BR", "BL"), ("BL", "FR"), ("FR", "FL"), ("FL", "BR"))
    ]
    states = [{"name": one["from"], "stance": [one["from"]]} for one in gallop]
    machine = RewardMachine.from_dict(TROT | {"state": states, "transition": gallop})
    expected = machine.expected(np.arange(4))
    np.testing.assert_array_equal(expected, contacts("BR BL", "BL FR", "FR FL", "FL BR"))


def test_entering_takes_the_stance_most_feet_agree_with_and_the_first_of_equals():
    trot = RewardMachine.from_dict(TROT)
    shown = contacts("FL BR", "FR BL", "FL", "FR BL BR", "", "FL FR BL BR", "FL FR", "BL")
    assert trot.enter(shown).tolist() == [0, 1, 0, 1, 0, 0, 0, 1]
    assert trot.shows_stance(shown).tolist() == [True, True] + [False] * 6
    assert trot.shows_state(np.zeros(8, dtype=int), shown).tolist() == [True] + [False] * 7
    assert trot.shows_state(np.ones(8, dtype=int), shown).tolist() == [False, True] + [False] * 6


def test_an_accepting_state_is_never_entered_left_or_shown():
    tables = deepcopy(TROT)
    tables["state"].append({"name": "fall", "accepting": True})
    tables["transition"].append({"from": "FR_BL", "to": "fall", "down": [], "up": list(FEET)})
    machine = RewardMachine.from_dict(tables)
    assert machine.initial == 0
    assert machine.accepting == (2,)
    flight = contacts("")
    assert machine.enter(contacts("", "FL FR BL BR")).tolist() == [0, 0]
    assert not machine.shows_stance(flight)[0]
    assert machine.step(ints(1), flight, ints(30)).state.tolist() == [2]
    for pattern in PATTERNS:
        label = contacts(" ".join(pattern))
        assert not machine.shows_state(ints(2), label)[0]
        assert not machine.step(ints(2), label, ints(30)).changed[0]


# Faults -----------------------------------------------------------------------------------------


@quick
@given(machines())
def test_a_machine_comes_back_whole_from_json(tables):
    machine = RewardMachine.from_dict(tables)
    text = json.dumps(machine.to_dict(), allow_nan=False)
    assert RewardMachine.from_dict(json.loads(text)) == machine
    assert json.loads(text) == machine.to_dict()


@quick
@given(machines())
def test_mermaid_tells_every_state_and_every_edge_once(tables):
    lines = mermaid(RewardMachine.from_dict(tables)).splitlines()
    assert lines[0] == "stateDiagram-v2"
    for state in tables["state"]:
        assert sum(line.strip().startswith(f"{state['name']} : ") for line in lines) == 1
    arrows = sorted(line.split(":")[0].strip() for line in lines if "-->" in line)
    expected = [f"{t['from']} --> {t['to']}" for t in tables["transition"]] + ["[*] --> u0"]
    expected += [f"{s['name']} --> [*]" for s in tables["state"] if "accepting" in s]
    assert arrows == sorted(expected)
