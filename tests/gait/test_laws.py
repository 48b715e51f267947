"""Faulty machines and files are refused in one line; ranges may be left out."""

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitshift.errors import GaitshiftError
from gaitshift.gait import Guard, RewardMachine, read_toml
from trot_tables import SINK, TROT, contacts, edited, ints, quick

TO_SINK = {"from": "FL_BR", "to": "sink", "down": ["FR"], "up": ["FL"], "dwell": 3}
FROM_SINK = {"from": "sink", "to": "FL_BR", "down": ["FL"], "up": []}
LONE = {"name": "lone", "stance": ["FL"]}
FROM_LONE = {"from": "lone", "to": "FL_BR", "down": ["BR"], "up": []}
T2 = "transition 2 (FR_BL -> FL_BR): "
FAULTS = [
    (edited(transition__2__up=["LF"]), T2 + "foot must be one of FL, FR, BL, BR, got 'LF'"),
    (edited(state__1__stance=["HL"]), "state 1 (FL_BR): foot must be one of FL, FR"),
    (edited(transition__2__up=["FL"]), T2 + "a foot must be in 'down' or in 'up', got FL in both"),
    (edited(transition__2__up=["FR", "FR"]), T2 + "'up' must name each foot once, got FR twice"),
    (edited(transition__2__up="FR"), T2 + "'up' must be a list of feet, such as"),
    (edited(transition__2__up=[1]), T2 + "'up' must be a list of feet, such as"),
    (edited(transition__2__down=None), T2 + "key 'down' is missing"),
    (
        edited(transition__2__dwel=3),
        "transition 2: unknown key 'dwel'; did you mean 'dwell'? known keys",
    ),
    (edited(transition__2__dwell=-1), T2 + "dwell must be 0 to 1000 control steps, got -1"),
    (edited(transition__2__dwell=2.5), T2 + "'dwell' must be a whole number, got 2.5"),
    (edited(transition__2__dwell=True), T2 + "'dwell' must be a whole number, got True"),
    (edited(transition__2__swing_height=0.4), T2 + "swing_height must be 0 to 0.3 m, got 0.4"),
    (edited(transition__2__swing_height="3cm"), T2 + "'swing_height' must be a number, got '3cm'"),
    (
        edited(transition__2__swing_height=10**400),
        T2 + "'swing_height' must be a number of at most 1e308",
    ),
    (edited(transition__2__bonus=float("inf")), T2 + "'bonus' must be a finite number, got inf"),
    (
        edited(transition__2__to="FL_RB"),
        "transition 2 (FR_BL -> FL_RB): unknown state 'FL_RB';"
        " did you mean 'FL_BR'? known states: FL_BR, FR_BL",
    ),
    (
        edited(transition__2__to="FR_BL"),
        "transition 2 (FR_BL -> FR_BL): 'from' and 'to' must be different",
    ),
    (edited(transition__2="x"), "transition 2: must be a table of keys and values, got 'x'"),
    (edited(transition={}), "'transition' must be a list of tables, [[transition]], got {}"),
    (edited(transition=None), "state FL_BR has no transition from it"),
    (edited(height=0.4), "height_range must end at 0.3 m or below, got 0.4"),
    (edited(height=0.1, height_range=[0.2, 0.3]), "height_range must be two rising numbers"),
    (edited(height_range=[-0.1, 0.5]), "height_range must end at 0.3 m or below, got 0.5"),
    (edited(lateral_speed=-0.1), "lateral_speed must be 0 to 3 m/s, got -0.1"),
    (edited(lateral_speed="fast"), "'lateral_speed' must be a number, got 'fast'"),
    (edited(state=[]), "there must be at least one [[state]]"),
    (edited(state__2__name="FL_BR"), "state 2: names must differ, got 'FL_BR' again"),
    (edited(state__2__name="FL BR"), "state 2 (FL BR): name must be letters, digits and"),
    (edited(state__2__name=""), "state 2: 'name' must be a text, got ''"),
    (edited(state__2__stance=None), "state 2 (FR_BL): key 'stance' is missing"),
    (edited(state__2__accepting=1), "state 2 (FR_BL): 'accepting' must be true or false, got 1"),
    (
        edited(state__2__accepting=True),
        "state 2 (FR_BL): an accepting state must not have a 'stance'",
    ),
    (
        edited(state__1={"name": "FL_BR", "accepting": True}),
        "state FL_BR: the first state must not be accepting",
    ),
    (edited(state=[*TROT["state"], LONE]), "state lone has no transition from it"),
    (
        edited(state=[*TROT["state"], LONE], transition=[*TROT["transition"], FROM_LONE]),
        "state lone cannot be reached from the first state, FL_BR",
    ),
    (
        edited(state=[*TROT["state"], SINK], transition=[*TROT["transition"], FROM_SINK]),
        "transition 3 (sink -> FL_BR): a transition must not leave an accepting state",
    ),
    (
        edited(state=[*TROT["state"], SINK], transition=[*TROT["transition"], TO_SINK]),
        "transition 1 (FL_BR -> FR_BL) and transition 3 (FL_BR -> sink): only one guard may"
        " hold at a time, both hold with FR BL down",
    ),
    (
        edited(transition__2__down=[], transition__2__up=[]),
        T2 + "the guard must not hold in the stance of its source FR_BL (FR BL down)",
    ),
    (
        edited(transition__2__down=["FL", "FR"], transition__2__up=[]),
        T2 + "the guard must hold in the stance of its target FL_BR (FL BR down)",
    ),
    (edited(dwell=None), "key 'dwell' is missing"),
    (edited(dwell=1001), "dwell must be 0 to 1000 control steps, got 1001"),
    (edited(swing_height=float("nan")), "'swing_height' must be a finite number, got nan"),
    (edited(dwel=3), "unknown key 'dwel'; did you mean 'dwell'? known keys: name, title"),
    (
        edited(dwell_range=[25, 15]),
        "dwell_range must be two rising numbers with dwell = 20 between them, got 25 to 15",
    ),
    (edited(dwell_range=[21, 30]), "dwell_range must be two rising numbers with dwell = 20"),
    (edited(dwell_range=[-1, 30]), "dwell_range must be two rising numbers with dwell = 20"),
    (edited(dwell_range=[10, 20.5]), "dwell_range must be two whole numbers of control steps"),
    (edited(dwell_range=[10, float("inf")]), "'dwell_range' must be finite numbers, got [10, inf]"),
    (edited(dwell_range=[float("nan"), 30]), "'dwell_range' must be finite numbers, got [nan, 30]"),
    (
        edited(dwell_range=[0, 30]),
        "dwell_range must begin at 1 or more where dwell is above 0, got 0 with dwell 20",
    ),
    (
        edited(dwell=0, transition__2__dwell=20),
        T2 + "dwell must be 0 where the machine's dwell is 0, got 20",
    ),
    (edited(speed=0), "speed must be above 0 m/s, got 0"),
    (
        edited(speed=0.0, speed_range=[0.0, 1.0]),
        "speed must be above 0 m/s, got 0",
    ),
    (edited(dwell_range=[10, 1001]), "dwell must be 0 to 1000 control steps, got 1001"),
    (edited(dwell_range=[20]), "'dwell_range' must be two numbers, such as [0.4, 1.6], got [20]"),
    (edited(dwell_range=20), "'dwell_range' must be two numbers, such as"),
    (edited(dwell_range=[True, 30]), "'dwell_range' must be two numbers, such as"),
    (edited(speed_range=[0.4, 10**400]), "'speed_range' must be numbers of at most 1e308"),
    (edited(speed="fast"), "'speed' must be a number, got 'fast'"),
    (edited(speed=-0.1), "speed_range must be two rising numbers with speed = -0.1"),
    (
        edited(speed=0.9, speed_range=[1.0, 1.6]),
        "speed_range must be two rising numbers with speed = 0.9 between them, got 1 to 1.6",
    ),
    (edited(speed_range=[0.4, 3.1]), "speed_range must end at 3 m/s or below, got 3.1"),
    (edited(speed=float("nan")), "'speed' must be a finite number, got nan"),
    (
        edited(name="my trot"),
        "name must be letters, digits, '_' and '-', a letter first, got 'my trot'",
    ),
    (edited(title=3), "'title' must be a text, got 3"),
    (edited(ideal_phase=[0, 0.5, 0.5, 0]), "ideal_phase: must be a table of keys and values"),
    (edited(ideal_phase__BR=None), "ideal_phase: key 'BR' is missing"),
    (edited(ideal_phase__BR=1.0), "ideal_phase: BR must be at least 0 and below 1, got 1"),
    ([1], "must be a table of keys and values, got [1]"),
]


@pytest.mark.parametrize(("tables", "message"), FAULTS, ids=[m[:50] for _, m in FAULTS])
def test_a_faulty_machine_is_refused_in_one_line(tables, message):
    with pytest.raises(GaitshiftError) as caught:
        RewardMachine.from_dict(tables)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_guards_that_differ_in_dwell_or_height_alone_can_hold_at_once():
    twin = TROT["transition"][0] | {"dwell": 5, "swing_height": 0.1}
    with pytest.raises(GaitshiftError, match="both hold with FR BL down"):
        RewardMachine.from_dict(edited(transition=[*TROT["transition"], twin]))


def test_two_states_may_be_joined_by_guards_that_exclude_each_other():
    loose = {"from": "FL_BR", "to": "FR_BL", "down": ["FR", "BL", "FL"], "up": [], "dwell": 30}
    machine = RewardMachine.from_dict(edited(transition=[*TROT["transition"], loose]))
    label = contacts("FR BL", "FR BL FL", "FR BL FL", "FR BL BR")
    told = machine.step(ints(0, 0, 0, 0), label, ints(20, 20, 30, 30))
    assert told.changed.tolist() == [True, False, True, False]


def test_a_machine_made_in_code_keeps_the_same_laws():
    trot = RewardMachine.from_dict(TROT)
    with pytest.raises(GaitshiftError, match="state FR_BL has no transition"):
        replace(trot, edges=trot.edges[:1])
    with pytest.raises(GaitshiftError, match="got FL in both"):
        Guard(down=frozenset({"FL"}), up=frozenset({"FL"}))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"# trot\n", "the file is empty"),
        (b'name = "a"\nstate = oops\n', "the file is not valid TOML: Invalid value (at line 2"),
        (b"\xff\xfe\x00", "the file must be TOML in UTF-8"),
        (b"dwell = " + b"9" * 5000, "the file is not valid TOML: "),
        (b"dwell = 20\nstance = 1", "unknown key 'stance'"),
        (b"dwell = 1979-05-27", "'dwell' must be a whole number, got datetime.date(1979, 5, 27)"),
        (None, "no such file"),
    ],
)
def test_a_faulty_file_is_refused_with_its_path(tmp_path, content, message):
    path = tmp_path / "my_gait.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(GaitshiftError) as caught:
        read_toml(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)


def test_a_folder_is_not_a_gait_file(tmp_path):
    with pytest.raises(GaitshiftError, match="the file cannot be read: "):
        read_toml(tmp_path)


RANGES = ("dwell_range", "speed", "speed_range")
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.just("FL"),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["name", "from", "down", "x"]), inner, max_size=3)
    ),
    max_leaves=6,
)


@quick
@given(changes=st.dictionaries(st.sampled_from([*TROT, *RANGES]), values, min_size=1, max_size=2))
def test_whatever_a_file_holds_the_error_is_ours(changes):
    with suppress(GaitshiftError):
        RewardMachine.from_dict(TROT | changes)


def test_ranges_are_read_and_left_out_they_are_the_gaits_own_value_alone():
    told = RewardMachine.from_dict(
        TROT | {"dwell_range": [15, 25], "speed": 0.8, "speed_range": [0.5, 1]}
    )
    assert (told.dwell_range, told.speed, told.speed_range) == ((15, 25), 0.8, (0.5, 1.0))
    silent = RewardMachine.from_dict(TROT)
    # 1.2 m/s is the paper's speed.
    assert (silent.dwell_range, silent.speed, silent.speed_range) == ((20, 20), 1.2, (1.2, 1.2))


def test_a_machine_without_any_lock_out_and_a_speed_range_from_rest_are_lawful():
    free = RewardMachine.from_dict(TROT | {"dwell": 0, "speed": 0.5, "speed_range": [0, 1]})
    assert (free.dwell, free.dwell_range, free.speed_range) == (0, (0, 0), (0.0, 1.0))
    assert {edge.guard.dwell for edge in free.edges} == {0}


# Files and drawings -----------------------------------------------------------------------------
