"""Folders of runs that are refused, and files in them that are damaged."""

import json
import shutil

import pytest

from full_disk import full_disk
from gaitshift.errors import GaitshiftError
from gaitshift.learn.run import Run
from training import KilledError, create, rows, same_bits, weights


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"\n2,", b"\ntwo,", "progress.csv, line 3 is damaged"),
        (b"\n2,flat,", b"\n2,flat,flat,", "progress.csv, line 3 is damaged"),
        (b"iteration,", b"iteratio,", "progress.csv, line 2 is damaged"),
        (b"\n2,flat,", b"\n2,fl\xff\xfe,", "progress.csv is damaged: "),
    ],
)
def test_a_damaged_progress_is_named_and_left_alone(copied, old, new, says):
    path = copied / "progress.csv"
    damaged = path.read_bytes().replace(old, new, 1)
    assert damaged != path.read_bytes()
    path.write_bytes(damaged)
    with pytest.raises(GaitshiftError) as caught:
        Run.resume(copied).train()
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == damaged


def test_a_config_of_another_network_than_the_checkpoints_is_named(copied):
    file = copied / "config.json"
    for hidden in ([32, 8], [16]):
        config = json.loads(file.read_text())
        config["recipe"]["ppo"]["hidden"] = hidden
        file.write_text(json.dumps(config))
        line = refusal(copied)
        assert "000006.pt does not fit" in line
        assert "config.json" in line


def test_an_empty_folder_is_taken(tmp_path):
    create(tmp_path)
    assert (tmp_path / "config.json").is_file()


def test_a_folder_with_something_in_it_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(GaitshiftError, match="not empty; give another --out, --overwrite"):
        create(tmp_path)
    with pytest.raises(GaitshiftError, match="not a training run and is not overwritten"):
        create(tmp_path, overwrite=True)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_file_in_the_place_of_the_folder_is_refused_and_left_alone(tmp_path, overwrite):
    file = tmp_path / "run"
    file.write_text("years of work")
    with pytest.raises(GaitshiftError, match=str(file)):
        create(file, overwrite=overwrite)
    assert file.read_text() == "years of work"


def test_overwriting_an_earlier_run_leaves_nothing_of_it(tmp_path, whole):
    folder = tmp_path / "run"
    shutil.copytree(whole[0].folder, folder)
    with pytest.raises(GaitshiftError, match="--resume"):
        create(folder)
    create(folder, seed=9, overwrite=True)
    assert [file.name for file in (folder / "checkpoints").iterdir()] == ["000000.pt"]
    assert sorted(file.name for file in folder.iterdir()) == ["checkpoints", "config.json"]
    assert Run.resume(folder).iteration == 0


def killed_before_its_first_checkpoint(folder, monkeypatch):
    """The config file as it was then."""

    def killed(*_):
        raise KilledError

    with monkeypatch.context() as patched:
        patched.setattr("torch.save", killed)
        with pytest.raises(KilledError):
            create(folder)
    return (folder / "config.json").read_bytes()


def test_a_run_killed_before_its_first_checkpoint_begins_again_in_its_folder(
    tmp_path, monkeypatch, whole
):
    killed_before_its_first_checkpoint(tmp_path, monkeypatch)
    (tmp_path / "checkpoints" / "000000.pt.part").write_bytes(b"half")
    run = create(tmp_path)
    assert same_bits(weights(run), weights(Run.resume(tmp_path)))
    run.train()
    assert same_bits(weights(run), weights(whole[0]))


def test_a_run_killed_before_its_first_checkpoint_is_resumed_from_its_beginning(
    tmp_path, monkeypatch, whole
):
    killed_before_its_first_checkpoint(tmp_path, monkeypatch)
    run = Run.resume(tmp_path)
    assert run.iteration == 0
    run.train()
    assert same_bits(weights(run), weights(whole[0]))
    assert rows(tmp_path) == rows(whole[0].folder)


@pytest.mark.parametrize("length", [0, 7, 100])
def test_a_run_whose_config_was_torn_by_a_full_disk_begins_again(tmp_path, monkeypatch, length):
    config = killed_before_its_first_checkpoint(tmp_path, monkeypatch)
    (tmp_path / "config.json").write_bytes(config[:length])
    create(tmp_path)
    assert (tmp_path / "config.json").read_bytes() == config
    assert Run.resume(tmp_path).iteration == 0


def test_a_config_of_another_program_is_not_ours_to_replace(tmp_path):
    (tmp_path / "config.json").write_text('{"theme": "dark"}')
    with pytest.raises(GaitshiftError, match="not empty"):
        create(tmp_path)
    assert (tmp_path / "config.json").read_text() == '{"theme": "dark"}'


def test_a_full_disk_leaves_no_torn_config_behind(tmp_path):
    with full_disk(), pytest.raises(OSError, match="File too large"):
        create(tmp_path)
    assert not list(tmp_path.iterdir())
    create(tmp_path)


def refusal(folder):
    """The one line with which a folder is refused."""
    with pytest.raises(GaitshiftError) as caught:
        Run.resume(folder)
    line = str(caught.value)
    assert "\n" not in line
    assert str(folder) in line
    return line


@pytest.fixture
def copied(tmp_path, whole):
    """A folder of a run, to be damaged."""
    return shutil.copytree(whole[0].folder, tmp_path / "run")


def test_a_folder_that_is_no_run_cannot_go_on(tmp_path):
    assert "not a training run: it has no config.json" in refusal(tmp_path)
    assert "not a training run" in refusal(tmp_path / "nowhere")


def damage_whole(config):
    return config[: len(config) // 2]


def damage_key(config):
    return config.replace(b'"recipe"', b'"receipt"')


def damage_field(config):
    return config.replace(b'"robots"', b'"robotsandmore"')


def damage_bytes(config):
    return b"\xff\xfe\x00" + config


def damage_shape(config):
    return b"[1, 2, 3]"


@pytest.mark.parametrize(
    "damage", [damage_whole, damage_key, damage_field, damage_bytes, damage_shape]
)
def test_a_damaged_config_is_named(copied, damage):
    file = copied / "config.json"
    file.write_bytes(damage(file.read_bytes()))
    assert "config.json is damaged" in refusal(copied)


def test_a_config_whose_machine_breaks_the_laws_is_named(copied):
    file = copied / "config.json"
    config = json.loads(file.read_text())
    config["machine"]["transition"][0]["to"] = "nowhere"
    file.write_text(json.dumps(config))
    assert "nowhere" in refusal(copied)


def test_a_damaged_checkpoint_is_named_and_without_it_the_run_goes_on_from_the_one_before(
    copied, whole
):
    last = copied / "checkpoints" / "000006.pt"
    last.write_bytes(last.read_bytes()[:2000])
    assert "000006.pt is damaged; remove it" in refusal(copied)
    last.unlink()
    run = Run.resume(copied)
    assert run.iteration == 4
    run.train()
    assert same_bits(weights(run), weights(whole[0]))
    assert rows(copied) == rows(whole[0].folder)


def test_a_verdict_cut_in_its_last_cell_is_made_again(copied):
    verdict = {"gait": "trot", "clean": False, "misses": "stride 2.10 Hz above 2.00"}
    run = Run.resume(copied)
    run.train(judge=lambda path: verdict)
    path = copied / "verdicts.csv"
    whole_file = path.read_bytes()
    path.write_bytes(whole_file[:-6])
    Run.resume(copied).train(judge=lambda path: verdict)
    assert path.read_bytes() == whole_file


def test_a_run_without_checkpoints_cannot_go_on(copied):
    shutil.rmtree(copied / "checkpoints")
    assert "no checkpoint" in refusal(copied)
