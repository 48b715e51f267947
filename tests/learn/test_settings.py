"""Settings of a recipe from a file and from the command line."""

import json
from dataclasses import replace

import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.learn.recipe import Recipe
from gaitshift.learn.settings import differences, with_settings

DEFAULT = Recipe()


def test_a_recipe_without_settings_is_the_recipe():
    assert with_settings(DEFAULT, ()) == DEFAULT
    assert differences(DEFAULT, DEFAULT) == {}


def test_each_setting_changes_its_own_field_and_is_the_difference():
    changed = with_settings(
        DEFAULT,
        ("reward.power=-0.05", "ppo.epochs = 4", "stages.flat.iterations=200", "robots=64"),
    )
    assert changed.env.reward == replace(DEFAULT.env.reward, power=-0.05)
    assert changed.ppo == replace(DEFAULT.ppo, epochs=4)
    assert changed.stages == (replace(DEFAULT.stages[0], iterations=200), *DEFAULT.stages[1:])
    assert changed.robots == 64
    assert differences(changed, DEFAULT) == {
        "ppo.epochs": (4, 3),
        "reward.power": (-0.05, DEFAULT.env.reward.power),
        "stages.flat.iterations": (200, 400),
        "robots": (64, 128),
    }


def test_a_file_says_the_same_as_the_command_line(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        "robots = 64\n[ppo]\nhidden = [64, 32]\nmirror = false\n[reward]\npower = -1\n"
        "[env.push]\nforce = 20.0\n[stages.rough]\nfidelity = 'coarse'\n"
    )
    line = ("robots=64", "ppo.hidden=[64, 32]", "ppo.mirror=false", "env.reward.power=-1")
    more = ("env.push.force=20", "stages.rough.fidelity=coarse")
    assert with_settings(DEFAULT, file=path) == with_settings(DEFAULT, (*line, *more))


def test_what_differences_name_is_what_settings_set():
    other = with_settings(DEFAULT, ("reward.slip=-2.0", "env.episode_steps=500", "ppo.clip=0.1"))
    settings = [f"{name}={value}" for name, (value, _) in differences(other, DEFAULT).items()]
    assert with_settings(DEFAULT, settings) == other


def test_the_order_of_settings_does_not_matter():
    bounds = ("strict_from=300", "strict_until=400")  # above and below the preset's other bound
    assert with_settings(DEFAULT, bounds) == with_settings(DEFAULT, bounds[::-1])


@pytest.mark.parametrize(
    "wrong", [("robots=3", "robots=4"), ("reward.power=-1", "env.reward.power=-1")]
)
def test_a_setting_that_is_given_twice_is_refused(wrong):
    with pytest.raises(GaitshiftError, match="must be given once"):
        with_settings(DEFAULT, wrong)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("ppo.epochs", "a setting must be NAME=VALUE, got 'ppo.epochs'"),
        ("ppo.epoch=3", "did you mean 'epochs'?"),
        ("stages.flatt.iterations=3", "did you mean 'flat'?"),
        ("reward.powr=1", "did you mean 'power'?"),
        ("ppo=3", "ppo has settings of its own"),
        ("stages=3", "stages has settings of its own"),
        ("ppo.epochs.more=3", "ppo.epochs must be a single value"),
        ("ppo.epochs=2.5", "ppo.epochs must be a whole number, got 2.5"),
        ("ppo.epochs=true", "ppo.epochs must be a number, got True"),
        ("ppo.epochs=many", "ppo.epochs must be a whole number, got 'many'"),
        ("ppo.epochs=0", "ppo.epochs must be 1 to 1000, got 0"),
        ("ppo.mirror=1", "ppo.mirror must be true or false, got 1"),
        ("ppo.discount=1.5", "discount must be 0 to 0.99999, got 1.5"),
        ("ppo.learning_rate=nan", "ppo.learning_rate must be a finite number, got nan"),
        ("reward.power=inf", "reward.power must be a finite number, got inf"),
        ("reward.bonus_mode=twice", "bonus_mode must be one of add"),
        ("env.observed=sight", "sight"),
    ],
)
def test_a_wrong_setting_is_named(setting, message):
    with pytest.raises(GaitshiftError) as error:
        with_settings(DEFAULT, (setting,))
    assert message in str(error.value)


def test_training_takes_settings_keeps_them_and_shows_them(tmp_path, capsys):
    run, mine = tmp_path / "run", tmp_path / "mine.toml"
    mine.write_text("[ppo]\nepochs = 1\nmini_batches = 1\n")
    size = ["robots=4", "steps=8", "reward.power=-0.05"]
    given = ["--recipe", str(mine), "--set", *size, "--iterations", "1"]
    main(["train", "trot", *given, "--out", str(run)])
    recipe = json.loads((run / "config.json").read_text())["recipe"]
    assert (recipe["ppo"]["epochs"], recipe["env"]["reward"]["power"]) == (1, -0.05)
    assert "reward.power is -0.05 (preset default: -0.0225)" in capsys.readouterr().err
    few = ["--set", "robots=1", "steps=3"]  # fewer than the preset has mini-batches
    for wrong in (["--set", "ppo.epochs=x"], ["--recipe", "none.toml"], few):
        with pytest.raises(SystemExit) as end:
            main(["train", "trot", *wrong, "--out", str(tmp_path / "other")])
        assert end.value.code == 2
        assert not (tmp_path / "other").exists()
    with pytest.raises(SystemExit) as end:
        main(["train", "--resume", str(run), "--set", "robots=3"])
    assert end.value.code == 2
