"""Readers of files: whatever the bytes, one line within limits of time and memory, or a value.

The limits themselves stand where the readers are; the inputs here are beyond each of them, or were
once read with a traceback, a hang or gigabytes of memory.
"""

import io
import json
import struct
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from onnx import TensorProto, helper

from gaitshift import table
from gaitshift.control import policy
from gaitshift.data import MOST_BYTES, json_in, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits, mermaid
from gaitshift.lab.identification.log_files import passages
from gaitshift.lab.log import Log
from gaitshift.lab.npz import arrays_in
from gaitshift.learn import checkpoint
from gaitshift.robot.description import Gains
from gaitshift.robot.robot_file import read_robot
from gaitshift.shift import load_graph
from gaitshift.show.plots import demo_figure
from gaitshift.show.report import write_report
from gaitshift.show.report.page import write_page
from gaitshift.show.viewer.server import as_markdown
from synthetic import log_of
from trot_tables import TROT, edited

ROOT = Path(__file__).parents[1]
PONY = ROOT / "examples" / "robots" / "pony.toml"
GRAPHS = ROOT / "src" / "gaitshift" / "shift" / "graphs"
few = settings(max_examples=40, deadline=5000)
"""Few examples, each within 5 s."""


def refusal(read, path):
    """The one line with which a file is refused."""
    with pytest.raises(GaitshiftError) as caught:
        read(path)
    line = str(caught.value)
    assert "\n" not in line
    return line


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# TOML and JSON ----------------------------------------------------------------------------------


DEEP = {
    "lists": "a=" + "[" * 5000 + "]" * 5000,
    "unclosed lists": "a=" + "[" * 5000,
    "tables": "a=" + "{b=" * 5000 + "1" + "}" * 5000,
    "dotted keys": ".".join("a" * 1000) + "=1",
    "thirty lists": "a=" + "[" * 30 + "]" * 30,
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_toml_within_toml_within_toml_is_refused(tmp_path, text):
    assert "at most 20 inside each other" in refusal(tables_in, written(tmp_path / "a.toml", text))


@pytest.mark.parametrize(
    "text", ["[" * 5000, "[" * 5000 + "]" * 5000, '{"a":' * 30 + "1" + "}" * 30]
)
def test_json_within_json_within_json_is_refused(tmp_path, text):
    assert "at most 20 inside each other" in refusal(json_in, written(tmp_path / "a.json", text))


@pytest.mark.parametrize("read", [tables_in, json_in])
def test_a_text_file_beyond_all_size_is_refused_before_it_is_read(tmp_path, read):
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(8 << 30)
    assert f"must have {MOST_BYTES} bytes or fewer" in refusal(read, path)


def test_numbers_of_5000_digits_are_refused(tmp_path):
    assert "not valid JSON" in refusal(json_in, written(tmp_path / "a.json", "9" * 5000))
    assert "not valid TOML" in refusal(tables_in, written(tmp_path / "a.toml", "a=" + "9" * 5000))


def mutated(content):
    """Bytes with a few places overwritten, cut out or doubled."""
    place = st.integers(0, max(len(content) - 1, 0))
    piece = st.binary(max_size=6) | st.sampled_from(
        [b"nan", b"inf", b"1e308", b"-1", b"99999999999999999999", b"[[", b'"', b"\xff", b"\x00"]
    )
    cut = st.integers(0, 12)

    def change(edits):
        data = content
        for at, new, length in edits:
            data = data[:at] + new + data[at + length :]
        return data

    return st.lists(st.tuples(place, piece, cut), min_size=1, max_size=4).map(change)


def reads_or_refuses(read, path):
    """A value or one line; nothing else is raised, and warnings are errors."""
    line = ""
    try:
        read(path)
    except GaitshiftError as error:
        line = str(error)
    assert "\n" not in line


TEXTS = {
    "gait": (lambda path: gaits.load(str(path)), (ROOT / "examples/robots/pony_trot.toml")),
    "graph": (load_graph, GRAPHS / "terrain.toml"),
    "robot": (read_robot, PONY),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_changed_bytes_of_a_toml_file_are_read_or_refused_in_a_line(tmp_path, kind):
    read, source = TEXTS[kind]
    (tmp_path / "pony.xml").write_bytes(PONY.with_suffix(".xml").read_bytes())

    @few
    @given(mutated(source.read_bytes()))
    def check(content):
        reads_or_refuses(read, written(tmp_path / "a.toml", content))

    check()


# Numbers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize(
    "key", ["foot_radius = 0.02 ", "action_scale = 0.3 ", "kp = 40.0", "kd = 1.0"]
)
def test_a_robots_numbers_are_finite(tmp_path, key, value):
    (tmp_path / "pony.xml").write_bytes(PONY.with_suffix(".xml").read_bytes())
    text = PONY.read_text()
    assert key in text
    name = key.split(" = ")[0]
    path = written(tmp_path / "pony.toml", text.replace(key, f"{name} = {value} "))
    assert f"'{name}' must be a finite number, got {value}" in refusal(read_robot, path)


@pytest.mark.parametrize(("kp", "kd"), [(1e308, 2.0), (80.0, 1e308), (np.nan, 2.0), (80.0, np.inf)])
def test_gains_are_those_of_a_motor(kp, kd):
    with pytest.raises(GaitshiftError, match="kp must be above 0 and kd 0 or more, both at most"):
        Gains(kp=kp, kd=kd)


def test_feet_of_a_table_are_near_the_robot(tmp_path):
    legs = ("FL", "FR", "BL", "BR")
    names = ["time", "rough", "gravity_x", "gravity_y", "gravity_z"]
    names += [f"contact_{leg}" for leg in legs]
    names += [f"foot_{leg}_{axis}" for leg in legs for axis in "xyz"]
    rows = [[0.01 * (i + 1), 0, 0, 0, -1, 1, 1, 1, 1] + [1e308] * 12 for i in range(3)]
    text = "\n".join(",".join(map(str, row)) for row in [names, *rows])
    path = written(tmp_path / "walk.csv", text)
    assert "row 1, 'foot_FL_x' must be -100 to 100, got 1e+308" in refusal(
        lambda file: list(passages(file)), path
    )


# Robots' models ---------------------------------------------------------------------------------


def pony(tmp_path, old, new):
    """The pony with its model changed."""
    text = PONY.with_suffix(".xml").read_text()
    assert old in text
    written(tmp_path / "pony.xml", text.replace(old, new, 1))
    return written(tmp_path / "pony.toml", PONY.read_bytes())


WORLD = "<worldbody>"
MODELS = {
    "timestep 1e-9": ('timestep="0.0025"', 'timestep="1e-9"', "timestep must be 0.0001 s or more"),
    "timestep 1e-320": ('timestep="0.0025"', 'timestep="1e-320"', "timestep must be 0.0001 s"),
    "timestep 0": ('timestep="0.0025"', 'timestep="0"', "timestep must be 0.0001 s or more"),
    "timestep nan": ('timestep="0.0025"', 'timestep="nan"', "timestep must be 0.0001 s or more"),
    "hfield": (
        WORLD,
        f'<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>{WORLD}',
        "hfield: nrow × ncol must be 4000000 or less, got 10000000000",
    ),
    "texture": (
        WORLD,
        '<asset><texture name="t" type="2d" builtin="flat" width="100000" height="100000"/></asset>'
        + WORLD,
        "texture: width × height must be 4000000 or less",
    ),
    "replicate": (
        WORLD,
        f'{WORLD}<replicate count="1000000"><geom size="1"/></replicate>',
        "elements must be 20000 or fewer",
    ),
    "replicate in replicate": (
        WORLD,
        f'{WORLD}<replicate count="1000"><replicate count="1000"><geom size="1"/></replicate>'
        "</replicate>",
        "elements must be 20000 or fewer",
    ),
    "composite": (
        WORLD,
        f'{WORLD}<composite type="cable" count="100000 1 1"><geom size="1"/></composite>',
        "elements must be 20000 or fewer",
    ),
    "memory": ('memory="64M"', 'memory="64T"', "size: memory must be 1024M or less, got 64T"),
    "keys": ('memory="64M"', 'nkey="100000000"', "size: nkey must be 10000 or less"),
    "singular inertia": (
        'fromto="0 0 -0.02 0 0 -0.18"',
        'fromto="0 1e20 -0.02 0 0 -0.18"',
        "MuJoCo warns of the model: Inertia matrix is too close to singular",
    ),
    "depth": (WORLD, WORLD + "<body>" * 200 + "</body>" * 200, "at most 100 inside each other"),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_model_beyond_all_size_is_refused_before_it_is_built(tmp_path, name):
    old, new, message = MODELS[name]
    assert message in refusal(read_robot, pony(tmp_path, old, new))


def test_an_included_file_has_the_same_limits(tmp_path):
    path = pony(tmp_path, WORLD, f'{WORLD}<include file="more.xml"/>')
    written(
        tmp_path / "more.xml",
        '<mujocoinclude><replicate count="1000000"><geom size="1"/></replicate></mujocoinclude>',
    )
    assert "elements must be 20000 or fewer" in refusal(read_robot, path)


def test_an_asset_beyond_all_size_is_refused(tmp_path):
    new = f'<asset><mesh name="m" file="m.stl"/></asset>{WORLD}'
    path = pony(tmp_path, WORLD, new)
    with (tmp_path / "m.stl").open("wb") as file:
        file.truncate(8 << 30)
    assert "m.stl must have 256 MB or less, got 8192 MB" in refusal(read_robot, path)


@few
@given(content=mutated(PONY.with_suffix(".xml").read_bytes()))
def test_changed_bytes_of_a_model_are_read_or_refused_in_a_line(tmp_path_factory, content):
    folder = tmp_path_factory.mktemp("model")
    written(folder / "pony.xml", content)
    reads_or_refuses(read_robot, written(folder / "pony.toml", PONY.read_bytes()))


# Logs -------------------------------------------------------------------------------------------


def log_file(path, **changed):
    """A log file with some arrays replaced."""
    log_of(np.ones((4, 2, 4), dtype=bool)).save(path)
    with np.load(path) as entries:
        values = {name: entries[name] for name in entries.files}
    for name, value in changed.items():
        values[name.replace("__", ".")] = value
    np.savez(path, **values)
    return path


@pytest.mark.parametrize("shape", [(10**12,), (10**23,), (10**6, 10**6)])
def test_an_array_of_a_declared_size_that_it_has_not_is_refused(tmp_path, shape):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    path = tmp_path / "log.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("k.npy", header.getvalue())
    assert "is not a complete npz file: 'k' must have the" in refusal(
        lambda file: arrays_in(file, ["k"]), path
    )


def test_arrays_that_unpack_beyond_all_memory_are_refused_before_they_are(tmp_path):
    """Five gigabytes of zeros that the file's index declares: nothing of them is unpacked."""
    header = io.BytesIO()
    size = 5 << 30
    np.lib.format.write_array_header_1_0(
        header, {"descr": "|u1", "fortran_order": False, "shape": (size,)}
    )
    path = tmp_path / "log.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("k.npy", header.getvalue() + bytes(1000))
    content = bytearray(path.read_bytes())
    at = content.rindex(b"PK\x01\x02")
    struct.pack_into("<I", content, at + 24, 0xFFFFFFFF)  # in the index: size in 64 bits, below
    extra = struct.pack("<HHQ", 1, 8, size + len(header.getvalue()))
    struct.pack_into("<H", content, at + 30, len(extra))
    name_end = at + 46 + len(b"k.npy")
    content[name_end:name_end] = extra
    end = content.rindex(b"PK\x05\x06")
    struct.pack_into("<I", content, end + 12, end - at)
    path.write_bytes(content)
    assert "arrays must have 4 GB or less in all, got 5 GB up to 'k'" in refusal(
        lambda file: arrays_in(file, ["k"]), path
    )


BAD_ARRAYS = {
    "far away": ("truth__base_position_w", np.full((4, 2, 3), 1e30), "must be -100000 to 100000"),
    "long legs": ("sensed__foot_position_b", np.full((4, 2, 4, 3), 1e308), "must be -100 to 100"),
    "surrogates": ("gaits", np.array(["\ud800"]), "'gaits' must be printable"),
    "surrogate terrain": ("terrain", np.array("\ud800"), "'terrain' must be printable"),
    "escapes": ("robot", np.array("a\x1b[2J"), "'robot' must be printable"),
    "long name": ("terrain", np.array("flat" * 1000), "'terrain' must have 2000 characters or"),
    "names as numbers": ("gaits", np.array([1, 2]), "'gaits' must be 64 texts or fewer, got int64"),
    "many gaits": ("gaits", np.array(["trot"] * 65), "'gaits' must be 64 texts or fewer"),
    "no ground": ("terrain_height", np.zeros((1, 1)), "must have two or more rows and columns"),
    "flat ground": ("terrain_size", np.array([0.0, 1.0]), "a size above 0"),
    "unknown state": ("machine_state", np.full((4, 2), 2**40), "'machine_state' must be 0 to 255"),
    "a period of words": ("sensed__period", np.array("fast"), "must be a number, got <U4"),
}


@pytest.mark.parametrize("name", BAD_ARRAYS)
def test_arrays_that_no_robot_can_have_left_are_refused(tmp_path, name):
    key, value, message = BAD_ARRAYS[name]
    assert message in refusal(Log.load, log_file(tmp_path / "log.npz", **{key: value}))


def test_a_cut_header_is_refused(tmp_path):
    content = log_file(tmp_path / "log.npz").read_bytes()
    at = content.index(b"\x93NUMPY")
    for length in (3, 7, 9, 12, 60):
        path = written(tmp_path / "cut.npz", content[: at + length] + content[at + length + 4 :])
        assert "is not a complete npz file" in refusal(Log.load, path)


def test_changed_bytes_of_a_log_are_read_or_refused_in_a_line(tmp_path):
    content = log_file(tmp_path / "log.npz").read_bytes()

    @few
    @given(mutated(content))
    def check(changed):
        reads_or_refuses(Log.load, written(tmp_path / "changed.npz", changed))

    check()


def test_the_page_of_a_robot_that_has_fallen_at_the_first_instant_is_written(tmp_path):
    log = log_of(np.ones((40, 1, 4), dtype=bool), fallen=np.ones((40, 1), dtype=bool))
    write_report(log, tmp_path / "index.html")
    assert "fall after 0.0 s" in (tmp_path / "index.html").read_text()


# Policies and checkpoints -----------------------------------------------------------------------


def test_a_policy_of_8_gigabytes_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "huge.onnx"
    with path.open("wb") as file:
        file.truncate(8 << 30)
    assert "must have 64 MB or less, got 8192 MB" in refusal(policy.load, path)


def shipped_with(path, **texts):
    """The shipped policy of the trot with other metadata."""
    model = onnx.load(str(policy.load("trot").path))
    entries = {entry.key: entry.value for entry in model.metadata_props}
    helper.set_model_props(model, entries | {f"gaitshift.{k}": v for k, v in texts.items()})
    onnx.save(model, str(path))
    return path


@pytest.mark.parametrize("name", ["machine", "training", "stance", "format_version"])
@pytest.mark.parametrize("text", ["[" * 5000, "9" * 5000, '"\\ud800"', "{" * 40])
def test_metadata_beyond_all_sense_are_refused_in_a_line(tmp_path, name, text):
    refusal(policy.load, shipped_with(tmp_path / "a.onnx", **{name: text}))


def network(path, fault):
    """A policy file whose network cannot be run as one of a robot must be."""
    model = onnx.load(shipped_with(path))
    size = model.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    weights = np.zeros((size, 12), dtype=np.float32)
    if fault == "not finite":
        weights[0, 0] = np.inf
    rows = 1 if fault == "one robot" else "N"
    kept = onnx.numpy_helper.from_array(weights, "weights")
    node = helper.make_node("MatMul", ["observation", "weights"], ["action"])
    graph = helper.make_graph(
        [node],
        "network",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, [rows, size])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [rows, 12])],
        [kept],
    )
    model.graph.CopyFrom(graph)
    onnx.save(model, str(path))
    return path


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("one robot", "cannot give 'action' for two robots"),
        ("not finite", "must give finite numbers"),
    ],
)
def test_a_network_that_cannot_run_is_refused_when_it_is_loaded(tmp_path, fault, message):
    policy.load(network(tmp_path / "fair.onnx", ""))
    assert message in refusal(policy.load, network(tmp_path / "a.onnx", fault))


@pytest.mark.parametrize("word", [b"gaitshift.robot", b"anymal_b", b"observation"])
def test_a_policy_file_with_a_text_that_is_not_utf_8_is_refused(tmp_path, word):
    content = policy.load("trot").path.read_bytes()
    assert word in content
    changed = content.replace(word, b"\xa3" + word[1:])
    assert "a.onnx is a truncated or damaged ONNX file" in refusal(
        policy.load, written(tmp_path / "a.onnx", changed)
    )


STATES = {
    "a list": [1, 2],
    "no iteration": {"wall_s": 0.0, "torch_rng": torch.get_rng_state(), "ppo": {}},
    "an iteration of words": {
        "iteration": "six",
        "wall_s": 0.0,
        "torch_rng": torch.get_rng_state(),
        "ppo": {},
    },
}


@pytest.mark.parametrize("name", STATES)
def test_a_checkpoint_that_is_none_is_named(tmp_path, name):
    torch.save(STATES[name], tmp_path / "000006.pt")
    assert "is damaged; remove it" in refusal(checkpoint.read, tmp_path / "000006.pt")


# Tables -----------------------------------------------------------------------------------------


def test_a_table_beyond_all_size_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "progress.csv"
    with path.open("wb") as file:
        file.truncate(8 << 30)
    assert "must have 256 MB or less, got 8192 MB" in refusal(table.read, path)


# Names on pages and in diagrams -----------------------------------------------------------------


class Page(HTMLParser):
    """The data of a page's scripts by their ids, and all text outside of scripts."""

    def __init__(self, text):
        super().__init__()
        self.data, self.words, self.scripts, self._of = {}, "", 0, None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "script":
            self.scripts += 1
            self._of = dict(attrs).get("id", "")

    def handle_endtag(self, tag):
        if tag == "script":
            self._of = None

    def handle_data(self, data):
        if self._of is None:
            self.words += data
        else:
            self.data[self._of] = self.data.get(self._of, "") + data


NAMES = ["<!--<script>", "</script>", "@SCRIPT@", "@DATA@", "@SECTIONS@", "@TITLE@", "\\u003c&amp;"]


@pytest.mark.parametrize("name", NAMES)
def test_a_name_in_a_log_is_shown_as_text_and_leaves_the_page_whole(tmp_path, name):
    contact = np.ones((40, 1, 4), dtype=bool)
    plain, odd = (log_of(contact, gaits=(g,), terrain=None) for g in ("hop", name))
    for log, file in ((plain, "plain.html"), (odd, "odd.html")):
        write_report(log, tmp_path / file)
    plain, odd = (Page((tmp_path / file).read_text()) for file in ("plain.html", "odd.html"))
    assert odd.scripts == plain.scripts
    assert odd.data[""] == plain.data[""], "the player's code"
    assert json.loads(odd.data["run0"])["gaits"][0]["name"] == name
    assert "<" not in odd.data["run0"], "nothing that a browser takes for a tag or a comment"
    assert odd.words.count(name) == plain.words.count("hop")


def test_places_in_what_is_put_into_a_page_are_text(tmp_path):
    sections = [("@DATA@", "<p>@SCRIPT@ @SUMMARY@</p>")]
    write_page(tmp_path / "a.html", title="@SUMMARY@", summary="@TITLE@", sections=sections)
    words = Page((tmp_path / "a.html").read_text()).words
    for name in ("@DATA@", "@SCRIPT@ @SUMMARY@", "@TITLE@"):
        assert name in words


@pytest.mark.parametrize("name", ["$\\frac$", "$", "a_{b}^"])
def test_a_name_in_a_log_is_drawn_as_text(tmp_path, name):
    log = log_of(np.ones((40, 1, 4), dtype=bool), gaits=(name,))
    demo_figure(log, tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 1000


@pytest.mark.parametrize("name", [*NAMES, "{1+1}", "**a**", "# a", "[a](b)"])
def test_a_name_in_the_viewers_markdown_is_text(name):
    (paragraph,) = [t for t in MarkdownIt("commonmark").parse(as_markdown(name)) if t.children]
    assert [(child.type, child.content) for child in paragraph.children] == [("text", name)]
    assert "{" not in as_markdown(name), "MDX takes it for code"


REFUSED_BY_MERMAID = (
    *("class", "note", "style", "href", "click", "state", "default", "classDef", "scale"),
    *("accTitle", "accDescr"),
)
"""Names that Mermaid 11 does not read as a state in `NAME --> other : text`."""


@pytest.mark.parametrize("name", [*REFUSED_BY_MERMAID, "end", "END", "Class"])
def test_states_with_names_that_mermaid_has_for_itself_get_another_identifier(name):
    first = TROT["state"][0]["name"]
    tables = json.loads(json.dumps(edited()).replace(f'"{first}"', f'"{name}"'))
    lines = [line.split() for line in mermaid(RewardMachine.from_dict(tables)).splitlines()[2:]]
    words = {end for line in lines for end in (line[0], line[2] if line[1] == "-->" else line[0])}
    reserved = {word.lower() for word in (*REFUSED_BY_MERMAID, "end")}
    assert not {word.lower() for word in words} & reserved
    assert len(words) == 3, "the start and two states"
    assert [name + ",", first.replace("_", " ").split()[0]] == lines[0][2:4], "the name is shown"


def test_a_gait_with_a_hyphen_is_one_state_of_a_drawn_graph(tmp_path):
    text = (GRAPHS / "terrain.toml").read_text().replace('"bound"', '"half-bound"')
    drawn = load_graph(written(tmp_path / "a.toml", text)).mermaid().splitlines()
    arrows = [line.split(" : ")[0].split() for line in drawn if "-->" in line]
    assert not any("-" in end for source, _, target in arrows for end in (source, target))
    assert sum("half-bound" in line for line in drawn) == 1


@pytest.mark.parametrize("name", ['"a\\nb"', '"a:b"', '"a;b"', '"1"', '"<b>"'])
def test_gaits_of_a_graph_have_names_that_can_be_drawn(tmp_path, name):
    text = (GRAPHS / "terrain.toml").read_text().replace('"bound"', name)
    path = written(tmp_path / "a.toml", text)
    assert "must be letters, digits, blanks" in refusal(load_graph, path)
