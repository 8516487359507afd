"""The rig on LCM: a controller in a second process, in lockstep and by the clock; LCM's own tools beside it; a
controller in plain Python.

usage: lcm_test.py SHIFTRIG SHIFTRIG_TCU SOURCE_FOLDER [TEST]...      (inside tests/io/with_multicast.sh)
"""
import csv
import importlib
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
RIG, TCU, SOURCE = sys.argv[1:4]
sys.path.insert(0, SOURCE + "/apps/examples")
from lcm_udpm import Types  # noqa: E402

BUS = "lcm:udpm://239.255.76.67:7667?ttl=0"
URL = BUS[4:]
SCENARIO = SOURCE + "/config/scenarios/plough_upshift.yaml"
TYPES = Types(SOURCE + "/lcmtypes")


def events(path):
    """(channel, time, data) of every event of an LCM log."""
    with open(path, "rb") as file:
        while header := file.read(28):
            sync, _, when, channel, length = struct.unpack(">IqqII", header)
            assert sync == 0xEDA1DA01
            yield file.read(channel).decode(), when, file.read(length)


def write_log(path, selected):
    with open(path, "wb") as file:
        for number, (channel, when, data) in enumerate(selected):
            file.write(struct.pack(">IqqII", 0xEDA1DA01, number, when, len(channel), len(data)) + channel.encode() + data)


def records(path):
    """What a run recorded, tick by tick, without the opening records."""
    return [(channel, data) for channel, _, data in events(path)
            if channel != "SHIFTRIG_REC_CHUNK" or TYPES["record_chunk_t"].decode(data)["kind"] == 4]


class Beside:
    """A program beside the rig, ended by SIGINT."""

    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        assert self.process.poll() is None, "%s ended by itself" % self.process.args[0]
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class OnLcm(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_rig(self, recording, *arguments):
        done = subprocess.run([RIG, "run", "--scenario", SCENARIO, "--controller", "none", "--bus", BUS, "--record",
                               recording, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=500)
        self.assertEqual(done.returncode, 0, done.stderr)

    def lockstep_run(self, name, *controller):
        with Beside(*controller):
            self.run_rig(self.path(name), "--pace", "lockstep", "--answer-timeout", "60")
        return self.path(name)

    def columns(self, recording):
        """The recording as {column: [value, ...]}."""
        path = recording + ".csv"
        subprocess.run([RIG, "export", recording, "--csv", path], check=True, stderr=subprocess.DEVNULL)
        with open(path, newline="", encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        return {name: [float(row[i]) for row in rows] for i, name in enumerate(head)}

    def explained(self, recording):
        return subprocess.run([RIG, "explain", recording], stdout=subprocess.PIPE, text=True, check=True).stdout

    def replays(self, recording):
        done = subprocess.run([RIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_two_lockstep_runs_give_the_same_records_to_the_byte(self):
        first = self.lockstep_run("first.lcmlog", TCU, "--bus", BUS, "--lockstep")
        second = self.lockstep_run("second.lcmlog", TCU, "--bus", BUS, "--lockstep")
        a, b = records(first), records(second)
        self.assertGreater(len(a), 6000)
        for (channel, one), (_, other) in zip(a, b):
            self.assertEqual(one, other, channel)
        self.assertEqual(len(a), len(b))
        self.assertIn("F3 locks", self.explained(first))
        self.replays(first)

    def test_wall_pace_gives_the_gears_of_lockstep_apart_by_the_recorded_latency(self):
        def gears(columns):
            """The gears the controller says it is in, and (when, F2 holds, F3 holds) of each change of them."""
            said, f2, f3 = (columns[name] for name in ("controller.current_gear", "clutch.F2.state", "clutch.F3.state"))
            changes = [(columns["time_s"][i], f2[i] == 0, f3[i] == 0) for i in range(1900, len(said))
                       if (f2[i] == 0) != (f2[i - 1] == 0) or (f3[i] == 0) != (f3[i - 1] == 0)]
            return [said[i] for i in range(1900, len(said)) if said[i] != said[i - 1]], changes

        lockstep = self.columns(self.lockstep_run("lockstep.lcmlog", TCU, "--bus", BUS, "--lockstep"))
        self.assertEqual(max(lockstep["bus.command_age_s"]), 0)
        # A controller that hears nothing for two of its cycles (20 ms) goes on by its own clock: a run in which the machine
        # kept it waiting so long is done again.
        for attempt in range(6):
            recording = self.path("wall_%d.lcmlog" % attempt)
            with Beside(TCU, "--bus", BUS):
                self.run_rig(recording, "--pace", "wall", "--duration", "2.8")
            wall = self.columns(recording)
            latency = max(wall["bus.command_age_s"][1000:])  # the lever moves at 2 s
            if latency < 0.02:
                break
        control_cycle_s = 0.01
        (said, one), (said_too, other) = gears(lockstep), gears(wall)
        self.assertEqual(said, [3])
        self.assertEqual(said_too, [3])
        self.assertEqual([held for _, *held in one], [[False, False], [False, True]])
        self.assertEqual([held for _, *held in other], [[False, False], [False, True]])
        for (expected, *_), (found, *_) in zip(one, other):
            # What comes late for one of the controller's cycles is seen in the next.
            self.assertLessEqual(abs(found - expected), latency + control_cycle_s + 1e-9)

    def test_logger_beside_the_rig_captures_all_that_its_recording_holds(self):
        # By the clock: of what lockstep sends as fast as it goes, lcm-logger's socket loses some. On a machine so busy that
        # the logger is not let run for the tenth of a second its socket can hold, the run is done again.
        for attempt in range(5):
            wire, recording = self.path("wire_%d.log" % attempt), self.path("run_%d.lcmlog" % attempt)
            with Beside("lcm-logger", "-q", "--lcm-url=" + URL, wire):
                time.sleep(1)
                with Beside(TCU, "--bus", BUS):
                    self.run_rig(recording, "--pace", "wall", "--factor", "0.5", "--duration", "3")
                time.sleep(0.5)
            seen = {channel: [TYPES[kind].decode(data) for name, _, data in events(wire) if name == channel]
                    for channel, kind in (("SHIFTRIG_SPEEDS", "speeds_t"), ("SHIFTRIG_CLUTCH_COMMAND", "clutch_command_t"),
                                          ("SHIFTRIG_PLANT_INFO", "plant_info_t"))}
            recorded = self.columns(recording)
            ticks = len(recorded["time_s"])
            speeds = {m["tick"]: m for m in seen["SHIFTRIG_SPEEDS"]}
            if len(speeds) == ticks:
                break
        self.assertEqual(sorted(speeds), list(range(1, ticks + 1)))
        self.assertIn("F3 locks", self.explained(recording))

        def names(field):
            return [bytes(n).split(b"\0")[0].decode() for n in seen["SHIFTRIG_PLANT_INFO"][0][field]]

        sensors, clutches = names("sensor_name"), names("clutch_name")
        for tick, message in speeds.items():
            for i in range(message["sensor_count"]):
                self.assertEqual(message["speed"][i], recorded["sensor.%s.speed_rad_s" % sensors[i]][tick - 1], (tick, sensors[i]))
        # The command in force in a tick is the newest one's, by its age: it answers the speeds of so long ago.
        commands = {m["sim_time_ns"]: m for m in seen["SHIFTRIG_CLUTCH_COMMAND"] if m["answers_seq"] >= 0}
        compared = 0
        for tick in range(ticks):
            asked = round(tick - 1000 * recorded["bus.command_age_s"][tick])
            if recorded["bus.clutch_command.status"][tick] != 1 or recorded["rig.safe_command"][tick] == 1:
                continue
            command = commands[asked * 1_000_000]
            for i, clutch in enumerate(clutches[:command["clutch_count"]]):
                column = "clutch.%s.pressure_command_pa" % clutch
                if command["enable"][i] and column in recorded:
                    self.assertEqual(command["pressure_pa"][i], recorded[column][tick], (tick, clutch))
                    compared += 1
        self.assertGreater(compared, 2 * ticks)

    def test_player_feeding_recorded_commands_reproduces_the_shift(self):
        # Recorded by the clock, played by the clock.
        wire, commands = self.path("wire.log"), self.path("commands.log")
        with Beside("lcm-logger", "-q", "--lcm-url=" + URL, wire):
            time.sleep(1)
            with Beside(TCU, "--bus", BUS):
                self.run_rig(self.path("live.lcmlog"), "--pace", "wall", "--duration", "4")
        self.assertIn("F3 locks", self.explained(self.path("live.lcmlog")))
        self.replays(self.path("live.lcmlog"))
        start = min(when for channel, when, data in events(wire) if channel == "SHIFTRIG_SPEEDS")
        write_log(commands, [e for e in events(wire) if e[0] == "SHIFTRIG_CLUTCH_COMMAND" and e[1] >= start])
        heard = self.path("heard.log")
        with Beside("lcm-logger", "-q", "--flush-interval=10", "--lcm-url=" + URL, heard):
            time.sleep(1)
            rig = subprocess.Popen([RIG, "run", "--scenario", SCENARIO, "--controller", "none", "--bus", BUS, "--pace", "wall",
                                    "--duration", "4", "--record", self.path("played.lcmlog")],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            # The player starts with the rig's first tick, however long the rig takes to prepare.
            patience = time.monotonic() + 100
            while time.monotonic() < patience and b"SHIFTRIG_SPEEDS" not in open(heard, "rb").read():
                time.sleep(0.02)
            subprocess.run(["lcm-logplayer", "--lcm-url=" + URL, commands], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                           timeout=200)
        self.assertEqual(rig.wait(200), 0)
        self.assertIn("F3 locks", self.explained(self.path("played.lcmlog")))

    def test_controller_in_plain_python_shifts_the_tractor(self):
        recording = self.lockstep_run("python.lcmlog", sys.executable, SOURCE + "/apps/examples/lcm_controller.py")
        self.assertIn("F3 locks", self.explained(recording))

    def test_missing_route_is_one_line(self):
        done = subprocess.run([RIG, "run", "--scenario", SCENARIO, "--controller", "none", "--bus",
                               "lcm:udpm://239.255.99.99:7667?ttl=0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stderr, "lcm:udpm://239.255.99.99:7667?ttl=0: no route for multicast; run: sudo ip link set lo "
                                      "multicast on && sudo ip route add 239.255.99.99/32 dev lo\n")


class Types_(unittest.TestCase):
    def test_lcm_gen_makes_every_language_and_agrees_on_the_fingerprints(self):
        with tempfile.TemporaryDirectory() as folder:
            sources = sorted(os.path.join(SOURCE, "lcmtypes", name) for name in os.listdir(SOURCE + "/lcmtypes") if name.endswith(".lcm"))
            for language in (["-c", "--c-cpath", folder, "--c-hpath", folder], ["-x", "--cpp-hpath", folder],
                             ["-j", "--jpath", folder], ["-l", "--lpath", folder], ["-p", "--ppath", folder]):
                subprocess.run(["lcm-gen", *language, *sources], check=True)
            sys.path.insert(0, folder)
            for name, kind in TYPES.items():
                generated = getattr(importlib.import_module("shiftrig." + name), name)
                self.assertEqual(generated._get_packed_fingerprint(), kind.fingerprint, name)
            self.assertEqual(len(TYPES), len(sources))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
