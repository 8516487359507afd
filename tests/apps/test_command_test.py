#!/usr/bin/env python3
"""shiftrig test on every shipped scenario: usage test_command_test.py SHIFTRIG SOURCE_FOLDER.

All pass with the reference controller; with the bad calibration shipped beside it exactly those fail that should;
the JUnit file parses and agrees; a broken expectation is one line with scenario, time, signal, expected, found."""
import glob
import os
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

shiftrig, source = sys.argv[1:3]
os.chdir(source)
folder = tempfile.mkdtemp()
failures = 0


def check(claim, holds, shown=""):
    global failures
    print("ok  " if holds else "FAIL", claim)
    if not holds:
        failures += 1
        print(shown)


def run(*words):
    return subprocess.run([shiftrig, "test", *words], capture_output=True, text=True)


scenarios = sorted(glob.glob("config/scenarios/*.yaml"))
check("there are at least 25 scenarios", len(scenarios) >= 25)

junit = os.path.join(folder, "all.xml")
everything = run(*scenarios, "--jobs", "2", "--junit", junit)
check("every scenario holds with the reference controller", everything.returncode == 0, everything.stdout + everything.stderr)
print(everything.stdout.splitlines()[-1])
suite = ElementTree.parse(junit).getroot().find("testsuite")
check("JUnit names every scenario once",
      sorted(case.get("name") for case in suite) == sorted(os.path.basename(s)[:-5] for s in scenarios))
check("JUnit counts no failure", suite.get("failures") == "0" and suite.get("errors") == "0")

bad = run("config/scenarios/plough_upshift.yaml", "--controller", "builtin:config/calibration/bad.yaml")
check("a bad calibration fails the upshift under the plough", bad.returncode == 1, bad.stdout + bad.stderr)
check("and says where, what, found and expected",
      re.search(r"config/scenarios/plough_upshift\.yaml:\d+:\d+: F2->F3 at \d+\.\d+ s: \w[\w.]* = [\d.]+; expected at most [\d.]+", bad.stdout),
      bad.stdout)
creep = run("config/scenarios/creep.yaml", "--controller", "builtin:config/calibration/bad.yaml")
check("but not creeping along, which needs no shift", creep.returncode == 0, creep.stdout + creep.stderr)

missing = run("config/scenarios/nowhere.yaml")
check("a scenario that is not there is one line and exit code 2",
      missing.returncode == 2 and "config/scenarios/nowhere.yaml: cannot be read" in missing.stdout, missing.stdout)
sys.exit(1 if failures else 0)
