"""`deploy` and `robot-sim` as their users meet them: real processes and sockets of one machine."""

import json
import select
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from gaitshift import table
from gaitshift.cli import main
from gaitshift.control.deployment.datagram import (
    Command,
    Decision,
    decode_command,
    decode_sensors,
    encode_command,
)
from gaitshift.lab.log import Log
from lockstep import ANGLES, standing
from waiting import PATIENCE

DECISION = Decision(
    gait="trot",
    machine_state=0,
    stance_shown=False,
    k=0.0,
    threshold=0.0,
    forward_speed=0.0,
    yaw_rate=0.0,
    stride_frequency=2.0,
)


@pytest.fixture
def ports():
    """Two ports that were free a moment ago."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    numbers = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return numbers


@pytest.fixture
def begin(tmp_path, ports):
    """Starts a command on the first port, with its peer on the second; ends what is left of it."""
    begun = []

    def start(command, *arguments, swap=False):
        here, there = ports[::-1] if swap else ports
        addresses = ["--port", str(here), "--peer", f"127.0.0.1:{there}"]
        process = subprocess.Popen(
            [sys.executable, "-m", "gaitshift", command, *addresses, *arguments],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        begun.append(process)
        return process

    yield start
    for process in begun:
        if process.poll() is None:
            process.kill()
        process.communicate()


class Peer:
    """The other side of a command: a socket that sends datagrams until it is silenced."""

    def __init__(self, ports, make):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", ports[1]))
        self._there = ("127.0.0.1", ports[0])
        self._make, self._is_silent, self._is_over = make, threading.Event(), threading.Event()
        self.got, self.came = [], threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join()
        self._socket.close()

    def fall_silent(self):
        self._is_silent.set()

    def _run(self):
        number = 0
        while not self._is_over.is_set():
            if not self._is_silent.is_set():
                number += 1
                data = self._make(number, self.got)
                if data is not None:
                    self._socket.sendto(data, self._there)
            end = time.monotonic() + 0.005
            while select.select([self._socket], [], [], max(0.0, end - time.monotonic()))[0]:
                self.got.append(self._socket.recv(4096))
                self.came.set()


def sensing(number, _):
    return standing(number, time.monotonic())


def ended(process):
    """Exit code, stdout, and the last line of stderr, before which there is only a greeting."""
    out, err = process.communicate(timeout=PATIENCE)
    lines = err.strip().splitlines()
    assert len(lines) <= 2, err
    return process.returncode, out, lines[-1]


def assert_soft_stop(datagrams):
    commands = [decode_command(data) for data in datagrams]
    begins = [command.is_stop for command in commands].index(True)
    assert all(command.is_stop for command in commands[begins:])
    assert commands[-1].kp == 0.0
    np.testing.assert_allclose(commands[-1].target, ANGLES, atol=1e-12)
    targets = np.array([command.target for command in commands[begins:]])
    stamps = np.array([command.stamp for command in commands[begins:]]) / 1e9
    speed = np.abs(np.diff(targets, axis=0)).max(axis=1) / np.diff(stamps)
    assert speed.max() <= 2.0 + 1e-6


@pytest.mark.slow
def test_a_robot_walks_behind_a_socket_and_both_sides_keep_what_they_know(begin, tmp_path):
    """Watchdogs wait as long as a busy machine may take; no rate is asserted."""
    patient = ["--watchdog", "10", "--json"]
    robot = begin("robot-sim", *patient, "--out", "robot", "--delay", "0.002")
    options = ["--wait", "300", "--seconds", "1.5", "--gaits", "trot,pace", "--every", "0.5"]
    controller = begin("deploy", *patient, *options, "--out", "deploy", swap=True)
    code, out, greeting = ended(controller)
    assert code == 0, greeting
    told = json.loads(out)
    assert [(one["from"], one["to"], one["time_s"]) for one in told["switches"]] == [
        ("trot", "pace", 0.5)
    ]
    assert told["datagrams"]["accepted"] > 1
    assert told["datagrams"]["malformed"] == 0
    assert told["round_trip_ms"]["p50"] > 2.0
    rows = table.read(tmp_path / "deploy" / "sensed.csv")
    assert len(rows) == 150
    assert json.loads((tmp_path / "deploy" / "summary.json").read_text()) == told
    code, out, greeting = ended(robot)
    assert code == 0, greeting
    log = Log.load(tmp_path / "robot" / "log.npz")
    assert log.gaits == ("trot", "pace")
    assert json.loads(out)["datagrams"]["malformed"] == 0
    assert np.ptp(log.truth.base_position_w[:, 0, 0]) > 0.05


def test_a_robot_that_vanishes_ends_deploy_in_one_line_after_a_soft_stop(begin, ports, tmp_path):
    process = begin("deploy", "--wait", "300", "--watchdog", "1", "--seconds", "3600")
    with Peer(ports, sensing) as peer:
        assert peer.came.wait(PATIENCE)
        peer.fall_silent()
        code, _, line = ended(process)
    assert code == 2
    assert "1000 ms" in line
    assert_soft_stop(peer.got)
    assert table.read(tmp_path / "gaitshift-deploy" / "sensed.csv")


@pytest.mark.parametrize(
    ("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["Ctrl-C", "SIGTERM"]
)
def test_a_stopped_deploy_stops_the_robot_softly(begin, ports, sent, code, tmp_path):
    process = begin("deploy", "--wait", "300", "--watchdog", "10", "--seconds", "3600")
    with Peer(ports, sensing) as peer:
        assert peer.came.wait(PATIENCE)
        process.send_signal(sent)
        assert ended(process)[0] == code
    assert_soft_stop(peer.got)
    assert json.loads((tmp_path / "gaitshift-deploy" / "summary.json").read_text())["fault"] == ""


def test_a_controller_that_vanishes_ends_robot_sim_in_one_line(begin, ports, tmp_path):
    def answer(number, got):
        if not got:
            return None
        return encode_command(
            Command(
                sequence=number,
                stamp=time.monotonic_ns(),
                answered=decode_sensors(got[-1]).sequence,
                target=ANGLES,
                kp=80.0,
                kd=2.0,
                is_stop=False,
                decision=DECISION,
            )
        )

    process = begin("robot-sim", "--watchdog", "1")
    with Peer(ports, answer) as peer:
        wait_for_follower(peer)
        peer.fall_silent()
        code, _, line = ended(process)
    assert code == 2
    assert "1000 ms" in line
    assert decode_sensors(peer.got[-1]).is_stopped
    log = Log.load(tmp_path / "gaitshift-robot" / "log.npz")
    assert log.gaits == ("trot",)


def wait_for_follower(peer):
    """Returns once the robot says that it follows a command."""
    assert peer.came.wait(PATIENCE)
    end = time.monotonic() + PATIENCE
    while decode_sensors(peer.got[-1]).acknowledged == 0:
        assert time.monotonic() < end
        time.sleep(0.01)


def refusal(capsys, *arguments):
    """The one line with which a command refuses."""
    with pytest.raises(SystemExit) as exit_:
        main(list(arguments))
    said = capsys.readouterr()
    assert exit_.value.code == 2
    assert said.out == ""
    (line,) = said.err.strip().splitlines()
    return line


@pytest.mark.parametrize("command", ["deploy", "robot-sim"])
def test_a_port_in_use_is_one_line(command, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = str(other.getsockname()[1])
        line = refusal(capsys, command, "--port", port)
    assert port in line
    assert "in use" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["deploy", "--peer", "robot"], "HOST:PORT"),
        (["deploy", "--peer", "127.0.0.1:0"], "port of the peer must be 1 to 65535, got 0"),
        (["deploy", "--port", "70000"], "port must be 1 to 65535, got 70000"),
        (["deploy", "--host", "no such host"], "'no such host' cannot be found"),
        (["deploy", "--watchdog", "0"], "watchdog must be 0.02 to 10, got 0.0"),
        (["deploy", "--speed", "nan"], "speed must be 0 to 3, got nan"),
        (["deploy", "--seconds", "0"], "seconds must be 0.1 to 3600, got 0.0"),
        (["deploy", "--graph", "lava"], "unknown graph 'lava'"),
        (["deploy", "--gaits", "canter"], "canter"),
        (["robot-sim", "--delay", "-1"], "delay must be 0 to 0.1, got -1.0"),
        (["robot-sim", "--loss", "1"], "loss must be 0 to 0.9, got 1.0"),
        (["robot-sim", "--terrain", "lava"], "unknown terrain 'lava'"),
        (["robot-sim", "--gains", "soft"], "gains must be one of default, paper, got 'soft'"),
        (["robot-sim", "--watchdog", "nan"], "watchdog must be 0.02 to 10, got nan"),
        (["robot-sim", "--seed", "-1"], "seed must be 0 or larger, got -1"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    arguments, says, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert says in refusal(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []


def test_no_robot_is_one_line_after_the_greeting(capsys, tmp_path, monkeypatch, ports):
    monkeypatch.chdir(tmp_path)
    addresses = ["--port", str(ports[0]), "--peer", f"127.0.0.1:{ports[1]}"]
    with pytest.raises(SystemExit) as exit_:
        main(["deploy", *addresses, "--wait", "0.1"])
    assert exit_.value.code == 2
    assert "is the robot on?" in capsys.readouterr().err.strip().splitlines()[-1]
    assert list(tmp_path.iterdir()) == []
