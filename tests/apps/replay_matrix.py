"""Record, then replay: bit for bit, for every scenario at every pace, with overruns, faults and a controller killed.

usage: replay_matrix.py SHIFTRIG SHIFTRIG_TCU SOURCE_FOLDER [--full] [TEST]...     (inside tests/io/with_multicast.sh)

As part of the suite the scenarios are cut at 6 s and wall pace is tried on two of them; --full runs all of them to their
ends at all three paces, each wall run with two stalls (a quarter of an hour, and room for 2 GB in the temporary folder).
"""
import concurrent.futures
import glob
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

RIG, TCU, SOURCE = sys.argv[1:4]
FULL = "--full" in sys.argv
CUT_S = 6
SCENARIOS = sorted(glob.glob(SOURCE + "/config/scenarios/*.yaml"))
PLOUGH = SOURCE + "/config/scenarios/plough_upshift.yaml"
LCM, UDPCAN = "lcm:udpm://239.255.76.67:7667?ttl=0", "udpcan:239.74.163.2:43113"


def name_of(scenario):
    return os.path.basename(scenario)[:-5]


def duration_of(scenario):
    with open(scenario, encoding="utf-8") as file:
        own = next(float(line.split(":")[1].split("#")[0]) for line in file if line.startswith("duration_s:"))
    return own if FULL else min(own, CUT_S)


def records(path):
    """Channel and bytes of everything behind the opening records, in order."""
    with open(path, "rb") as file:
        number = 0
        while header := file.read(28):
            _, _, _, channel, length = struct.unpack(">IqqII", header)
            name, data = file.read(channel), file.read(length)
            if number > 0 or name != b"SHIFTRIG_REC_CHUNK":
                number += 1
                yield name, data


class Replayed(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def start(self, scenario, pace, duration, recording, *arguments):
        return subprocess.Popen([RIG, "run", "--scenario", scenario, "--pace", pace, "--duration", str(duration), "--record",
                                 recording, "--json", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def result_of(self, process):
        out, err = process.communicate(timeout=1500)
        self.assertEqual(process.returncode, 0, err)
        return json.loads(out.splitlines()[-1]), err

    def assert_replays(self, recording, ticks):
        done = subprocess.run([RIG, "replay", recording, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        found = json.loads(done.stdout)
        self.assertTrue(found["agrees"])
        self.assertEqual(found["ticks"] + found["lost"], ticks)
        return found

    def tried(self, scenario, pace, stalls=()):
        """One run and its replay; `stalls`: (at, for how long) [s] of wall time in which the rig stands still."""
        recording = "%s/%s_%s.lcmlog" % (self.folder, name_of(scenario), pace)
        process = self.start(scenario, pace, duration_of(scenario), recording)
        for at, length in stalls:
            while not os.path.exists(recording):
                time.sleep(0.01)
            time.sleep(at)
            process.send_signal(signal.SIGSTOP)
            time.sleep(length)
            process.send_signal(signal.SIGCONT)
        result, _ = self.result_of(process)
        found = self.assert_replays(recording, result["ticks"])
        if FULL:
            print("  %-24s %-8s %7d ticks, %d lost in the recording, %d overruns, %d skipped" %
                  (name_of(scenario), pace, found["ticks"], found["lost"], result["overruns"], result["loop"]["skipped"]), flush=True)
        return recording, result, found

    def test_every_scenario_at_free_pace_and_in_lockstep_with_the_same_records(self):
        for scenario in SCENARIOS:
            with self.subTest(scenario=name_of(scenario)):
                free, _, found = self.tried(scenario, "free")
                self.assertEqual(found["lost"], 0)
                lockstep, _, found = self.tried(scenario, "lockstep")
                self.assertEqual(found["lost"], 0)
                for (channel, one), (_, other) in zip(records(free), records(lockstep)):
                    self.assertEqual(one, other, channel)
                self.assertEqual(os.path.getsize(free) // 1000, os.path.getsize(lockstep) // 1000)
                os.remove(free)
                os.remove(lockstep)

    def test_wall_pace_with_overruns(self):
        # 50 ms are caught up with, 400 ms are more than the 100 ticks that it may be behind: slots are skipped.
        def run(scenario):
            recording, result, found = self.tried(scenario, "wall", [(0.6, 0.05), (0.5, 0.4)])
            os.remove(recording)
            return name_of(scenario), result, found

        chosen = SCENARIOS if FULL else [PLOUGH, SOURCE + "/config/scenarios/corrupt_frames.yaml"]
        with concurrent.futures.ThreadPoolExecutor(6 if FULL else 2) as pool:
            for name, result, found in pool.map(run, chosen):
                with self.subTest(scenario=name):
                    self.assertGreater(result["overruns"], 0)
                    self.assertGreater(result["loop"]["skipped"], 200)
                    self.assertGreater(found["compared"], 0.9 * result["ticks"])

    def killed(self, bus, pace, *arguments):
        """A controller process of its own, killed while it works; every tick before and after replays."""
        recording = "%s/killed_%s_%s.lcmlog" % (self.folder, bus.split(":")[0], pace)
        lockstep = " --lockstep" if pace == "lockstep" else ""
        # Lockstep runs many times as fast as time: the kill comes somewhere in its twelve seconds.
        process = self.start(PLOUGH, pace, 12 if lockstep else 3.5, recording, "--bus", bus, "--controller",
                             "exec %s --bus '%s'%s" % (TCU, bus, lockstep), *arguments)
        # By the wall that is in mid-shift: F3 begins to fill at 2.0 s and locks before 2.4 s. The recording grows by 1.4 MB
        # a second and is written 0.2 s behind at most.
        while process.poll() is None and (not os.path.exists(recording) or os.path.getsize(recording) < 2.8e6):
            time.sleep(0.002)
        controller = subprocess.run(["pgrep", "-P", str(process.pid)], stdout=subprocess.PIPE, text=True).stdout.split()
        os.kill(int(controller[0]), signal.SIGKILL)
        result, err = self.result_of(process)
        self.assertIn("was ended by signal 9", err)
        self.assertIn("safe_command", [event["kind"] for event in result["events"]])
        self.assertEqual(result["final"]["rig.safe_command"], 1)
        self.assert_replays(recording, result["ticks"])
        return result

    def test_controller_process_killed_in_mid_shift(self):
        for bus in (LCM, UDPCAN):
            for pace, arguments in (("wall", ()), ("lockstep", ("--answer-timeout", "0.001"))):
                with self.subTest(bus=bus, pace=pace):
                    result = self.killed(bus, pace, *arguments)
                    if pace == "lockstep":
                        self.assertGreater(result["loop"]["unanswered"], 0)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *[word for word in sys.argv[4:] if word != "--full"]])
