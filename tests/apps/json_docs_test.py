"""What the commands print with --json is described where docs/ describes them: every key of the answer stands in the page.

usage: json_docs_test.py SHIFTRIG SOURCE_FOLDER
"""
import json
import os
import re
import subprocess
import sys
import unittest

from in_a_folder import Folder

SHIFTRIG, SOURCE = map(os.path.abspath, sys.argv[1:3])
SHIFT = SOURCE + "/config/scenarios/plough_upshift.yaml"
TRACTOR = SOURCE + "/config/tractor.yaml"


def keys(answer, names_below=()):
    """Of all maps in an answer, but for those that map somebody's names (the values of `names_below`)."""
    found = set()
    if isinstance(answer, list):
        for item in answer:
            found |= keys(item, names_below)
    elif isinstance(answer, dict):
        for key, value in answer.items():
            found.add(key)
            below = value.values() if key in names_below else [value]
            for item in below:
                found |= keys(item, names_below)
    return found


class Json(Folder):
    def answer(self, *arguments):
        done = subprocess.run([SHIFTRIG, *arguments], capture_output=True, text=True, timeout=240, cwd=self.folder)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        return json.loads(done.stdout)

    def assert_described(self, page, answer, names_below=()):
        with open(SOURCE + "/docs/" + page) as file:
            words = set(re.findall(r"`([a-z_0-9]+)`", file.read()))
        self.assertEqual(keys(answer, names_below) - words, set())

    def setUp(self):
        super().setUp()
        for name, more in (("u.lcmlog", ()), ("bad.lcmlog", ("--controller", "builtin:" + SOURCE + "/config/calibration/bad.yaml"))):
            subprocess.run([SHIFTRIG, "run", "--scenario", SHIFT, "--pace", "free", "--record", name, "--snapshot-at", "2.14", "s.snap", *more],
                           check=True, capture_output=True, cwd=self.folder)

    def test_of_check_and_statics(self):
        self.assert_described("model-files.md", self.answer("check", TRACTOR, "--json"), ("modes", "shape", "kinetic_share", "elastic_share"))
        self.assert_described("mechanics.md", self.answer("statics", TRACTOR, "--closed", "Fc,F2", "--input", "engine=100", "--json"),
                              ("links", "link_units", "meshes", "nodes"))

    def test_of_explain(self):
        self.assert_described("recording.md", self.answer("explain", "u.lcmlog", "--json"))

    def test_of_compare(self):
        self.assert_described("shift-quality.md", self.answer("compare", "u.lcmlog", "bad.lcmlog", "--json"))

    def test_of_fork(self):
        self.assert_described("recording.md", self.answer("fork", "s.snap", "--vary", "model.masses.vehicle.mass_kg=-1,7000", "--json"),
                              ("values", "metrics"))

    def test_of_replay(self):
        self.assert_described("recording.md", self.answer("replay", "u.lcmlog", "--json"))
        subprocess.run(["sed", "-i", "s/mass_kg: 14000/mass_kg: 14100/; s,can/tractor.yaml," + SOURCE + "/config/can/tractor.yaml,",
                        self.heavier()], check=True)
        answer = self.answer("replay", "u.lcmlog", "--model", "heavier.yaml", "--json")
        self.assertIn("first_difference", answer)
        self.assert_described("recording.md", answer)
        with open(self.path("f.csv"), "w") as file:
            file.write("time_s,driver.throttle,mass.engine.speed_rpm,remark\n0,0.5,1000,1\n0.05,7,1000,2\n")
        self.assert_described("recording.md", self.answer("replay", "f.csv", "--model", TRACTOR, "--json"))

    def heavier(self):
        with open(TRACTOR) as file, open(self.path("heavier.yaml"), "w") as copy:
            copy.write(file.read())
        return self.path("heavier.yaml")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
