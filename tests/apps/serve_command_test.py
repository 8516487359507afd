"""`shiftrig serve` as its user meets it: commands from the page while it records, a loop that gives up, disks that are full.

usage: serve_command_test.py SHIFTRIG CONFIG
"""
import glob
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import unittest
import urllib.error
import urllib.request

from in_a_folder import Folder

SHIFTRIG, CONFIG = sys.argv[1:3]
TRACTOR = CONFIG + "/tractor.yaml"
CAPACITY = "clutches.Fc.dry.sliding_capacity_nm"


class Served:
    def __init__(self, *arguments):
        self.process = subprocess.Popen([SHIFTRIG, "serve", *arguments, "--port", "0", "--rehearse", "0"], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        said = re.search(r"http\S+", self.process.stdout.readline())  # nothing, if it refuses to begin
        self.url = said.group(0).rstrip("/") if said else ""

    def post(self, verb, **body):
        """Status and text of the answer."""
        request = urllib.request.Request(self.url + "/api/" + verb, json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def end(self, how=signal.SIGTERM):
        """Exit status, what it said."""
        if how:
            self.process.send_signal(how)
        out, err = self.process.communicate(timeout=60)
        return self.process.returncode, out, err


class Serve(Folder):
    def assert_sound(self, recording):
        """It replays to its end; returns how many ticks."""
        done = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)["ticks"]

    def await_ticks(self, name):
        """Until there is more in a recording than its opening records."""
        path, until = self.path(name), time.time() + 20
        while not (os.path.exists(path) and os.path.getsize(path) > 500_000) and time.time() < until:
            time.sleep(0.02)

    def test_the_end_of_the_terminal_ends_it_with_its_recording_kept(self):
        rig = Served(TRACTOR, "--record", self.path("x.lcmlog"))
        self.await_ticks("x.lcmlog")
        status, _, err = rig.end(signal.SIGHUP)
        self.assertEqual(status, 0, err)
        self.assertGreater(self.assert_sound(self.path("x.lcmlog")), 0)

    def test_a_controller_that_ends_is_told_once_and_the_machine_goes_on(self):
        rig = Served(TRACTOR, "--bus", "inprocess", "--controller", "exit 3")
        line = 'controller "exit 3" ended with status 3\n'
        self.assertEqual(rig.process.stderr.readline(), line)
        with urllib.request.urlopen(rig.url + "/api/live", timeout=10) as stream:
            time.sleep(0.5)
            page = stream.read1(1 << 20).decode()
        self.assertIn("ended with status 3", page)
        status, out, err = rig.end()
        self.assertEqual((status, "ended with" in err), (0, False), err)
        self.assertGreater(int(re.search(r"(\d+) executed", out).group(1)), 300)

    def test_a_controller_that_is_no_program_is_refused_or_fails(self):
        with open(self.path("x.lcmlog"), "w") as file:
            file.write("mine")
        rig = Served(TRACTOR, "--bus", "inprocess", "--controller", "nixprog", "--record", self.path("x.lcmlog"))
        self.assertEqual(rig.end(None), (2, "", 'controller "nixprog" could not be started: there is no program nixprog\n'))
        with open(self.path("x.lcmlog")) as file:
            self.assertEqual(file.read(), "mine")
        rig = Served(TRACTOR, "--bus", "inprocess", "--controller", "'nixprog'")
        self.assertIn("not found", rig.process.stderr.readline())  # the shell
        self.assertEqual(rig.process.stderr.readline(), 'controller "\'nixprog\'" could not be started (status 127)\n')
        self.assertEqual(rig.end()[0], 1)

    def test_a_refused_parameter_is_told_to_who_asked_and_leaves_the_recording_as_it_was(self):
        rig = Served(TRACTOR, "--record", self.path("x.lcmlog"))
        status, text = rig.post("parameter", name=CAPACITY, value=-1)
        self.assertEqual(status, 400)
        self.assertRegex(text, r'clutch "Fc": dry\.sliding_capacity_nm = -1; must be > 0')
        status, text = rig.post("parameter", name="clutches.Fc.colour", value=1)
        self.assertEqual((status, text), (400, 'there is no parameter "clutches.Fc.colour"\n'))
        self.await_ticks("x.lcmlog")
        status, out, err = rig.end()
        self.assertEqual(status, 0, err)
        self.assertEqual(os.listdir(self.folder), ["x.lcmlog"])
        executed = int(re.search(r"(\d+) executed", out).group(1))
        self.assertGreater(executed, 100)
        self.assertEqual(self.assert_sound(self.path("x.lcmlog")), executed)

    def test_each_machine_has_a_recording_of_its_own(self):
        rig = Served(TRACTOR, "--record", self.path("x.lcmlog"))
        self.await_ticks("x.lcmlog")
        self.assertEqual(rig.post("parameter", name=CAPACITY, value=1500)[0], 200)
        self.await_ticks("x-2.lcmlog")
        self.assertEqual(rig.post("record", active=False)[0], 200)
        time.sleep(0.3)
        self.assertEqual(rig.post("record", active=True)[0], 200)
        self.await_ticks("x-3.lcmlog")
        status, _, err = rig.end(signal.SIGINT)
        self.assertEqual(status, 0, err)
        self.assertEqual(sorted(os.listdir(self.folder)), ["x-2.lcmlog", "x-3.lcmlog", "x.lcmlog"])
        for name in os.listdir(self.folder):
            self.assertGreater(self.assert_sound(self.path(name)), 0, name)

    def test_commands_from_all_sides_between_two_stretches(self):
        """Stretches begin and end while others pause, step and set the speed; the last of two changes may be refused by
        what the first one made of the machine."""
        rig = Served(TRACTOR, "--record", self.path("x.lcmlog"))
        until = time.time() + 3
        wrong = []

        def ask(*commands):
            while time.time() < until:
                for verb, body in commands:
                    status = rig.post(verb, **body)[0]
                    if status not in (200, 400):
                        wrong.append((verb, body, status))

        sides = [[("record", {"active": True}), ("parameter", {"name": CAPACITY, "value": 1400})],
                 [("parameter", {"name": CAPACITY, "value": -1}), ("record", {"active": False})],
                 [("pause", {"paused": True}), ("step", {"ticks": 1}), ("pause", {"paused": False})],
                 [("speed", {"factor": 2}), ("speed", {"factor": 1})]]
        threads = [threading.Thread(target=ask, args=side) for side in sides]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        status, _, err = rig.end()
        self.assertEqual((status, wrong), (0, []), err)
        for name in os.listdir(self.folder):
            done = subprocess.run([SHIFTRIG, "replay", self.path(name)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.assertNotIn("damaged", done.stderr, name)
            self.assertNotIn("cut short", done.stderr, name)

    def test_a_loop_that_gives_up_ends_it(self):
        for arguments, outcome in [(("--factor", "5000", "--overrun", "abort", "--catch-up", "0"), "too_far_behind"),
                                   (("--factor", "5000", "--when-late", "abort", "--late-limit", "1"), "late_too_often")]:
            for record in ((), ("--record", self.path(outcome + ".lcmlog"))):
                status, out, err = Served(TRACTOR, *arguments, *record).end(None)
                self.assertEqual(status, 1, err)
                self.assertIn(outcome, out)
        self.assertEqual(len(glob.glob(self.path("*.lcmlog"))), 2)

    def test_a_disk_that_is_full_is_told_and_the_exit_status_says_so(self):
        rig = Served(TRACTOR, "--duration", "0.5", "--record", "/dev/full")
        status, out, err = rig.end(None)
        self.assertEqual(status, 1)
        self.assertIn("/dev/full: cannot be written: No space left on device", err)
        self.assertIn("500 executed", out)

    def test_a_recording_that_cannot_be_created_is_bad_input(self):
        status, _, err = Served(TRACTOR, "--record", "/nosuch/dir/x.lcmlog").end(None)
        self.assertEqual(status, 2)
        self.assertRegex(err, r"\A\S*.*/nosuch/dir/x\.lcmlog: .*\n\Z")

    def test_a_taken_port_leaves_the_recording_of_who_has_it_alone(self):
        rig = Served(TRACTOR, "--record", self.path("x.lcmlog"))
        port = rig.url.rsplit(":", 1)[1]
        again = subprocess.run([SHIFTRIG, "serve", TRACTOR, "--port", port, "--record", self.path("x.lcmlog")], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, timeout=60)
        self.assertEqual(again.returncode, 2)
        self.await_ticks("x.lcmlog")
        self.assertEqual(rig.end()[0], 0)
        self.assertGreater(self.assert_sound(self.path("x.lcmlog")), 0)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
