#!/usr/bin/env python3
"""shiftrig test on every shipped scenario: usage test_command_test.py SHIFTRIG SOURCE_FOLDER.

All pass with the reference controller; with the bad calibration shipped beside it exactly those fail that should;
runs that gave up, are not finite or could not be kept whole fail whatever was expected of them; the JUnit file
parses and agrees; a broken expectation is one line with scenario, time, signal, expected, found."""
import glob
import json
import os
import re
import resource
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


def run(*words, **options):
    return subprocess.run([shiftrig, "test", *words], capture_output=True, text=True, **options)


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



def scenario(name, text):
    path = os.path.join(folder, name + ".yaml")
    with open(path, "w") as file:
        file.write(text)
    return path


# What the reader of the documentation tries first.
example = re.search(r"(?s)```yaml\n(.*?)```", open("docs/scenario-files.md").read())[1]
tried = run(scenario("example", example.replace("../tractor.yaml", os.path.abspath("config/tractor.yaml"))))
check("the example of docs/scenario-files.md holds", tried.returncode == 0, tried.stdout + tried.stderr)

# A `must_not` alone is kept by every run that does nothing: by one that gave up and by one that is not finite.
shift = open("config/scenarios/plough_upshift.yaml").read().replace("../tractor.yaml", os.path.abspath("config/tractor.yaml"))
only_must_not = re.sub(r"(?s)^expect:.*", "expect:\n  must_not:\n    - {kind: engine_stalls}\n", shift, flags=re.M)
shift = scenario("shift", only_must_not)
check("a run that holds passes", run(shift).returncode == 0)
junit = os.path.join(folder, "gave_up.xml")
gave_up = run(shift, "--pace", "wall", "--overrun", "abort", "--catch-up", "0", "--factor", "10000", "--junit", junit)
check("a run that gave up fails, whatever was expected",
      gave_up.returncode == 1 and re.search(r"shift\.yaml: the loop gave up after \d+ ticks: too_far_behind\n", gave_up.stdout),
      gave_up.stdout + gave_up.stderr)
check("in JUnit, too", ElementTree.parse(junit).getroot().get("failures") == "1")

scenario("fast", "name: fast\nmasses:\n  a: {inertia_kg_m2: 1, initial_speed_rad_s: 1e200}\n  b: {inertia_kg_m2: 1}\n"
         "shafts:\n  s: {a: a, b: b, stiffness_nm_per_rad: 1000, damping_nm_s_per_rad: 1}\n")
no_number = run(scenario("no_number", "model: fast.yaml\nabout: a speed whose square is none\nduration_s: 0.01\n"
                         "expect:\n  must_not:\n    - {kind: engine_stalls}\n"))
check("a run whose state is not finite fails, whatever was expected",
      no_number.returncode == 1 and "no_number.yaml: in 10 of 10 ticks the state is not finite\n" in no_number.stdout,
      no_number.stdout + no_number.stderr)

crowd = run(scenario("crowd", re.sub(r"(?ms)^timeline:.*?(?=^\w)", "", only_must_not) + "timeline:\n"
                     + "  - {at_s: 0.5, driver.throttle: 0.7}\n" * 300))
check("a run whose events did not all fit cannot be judged",
      crowd.returncode == 2 and "crowd.yaml: the run's events do not fit the memory: 44 too many\n" in crowd.stdout,
      crowd.stdout + crowd.stderr)

misspelt = run(scenario("misspelt", only_must_not + "    - {kind: lock, device: F22}\n"))
check("a device that the model does not have is one line and exit code 2, not kept by every run",
      misspelt.returncode == 2 and re.search(r"misspelt\.yaml:\d+:7: expect: lock of F22: no device of this model has "
                                             r"events by that name; nearest: F2\n", misspelt.stdout),
      misspelt.stdout + misspelt.stderr)

recordings = os.path.join(folder, "recordings")
os.mkdir(recordings)
os.mkdir(os.path.join(folder, "b"))
other = scenario("b/shift", only_must_not)
same_name = run(shift, other, "--record", recordings, "--jobs", "2")
check("two scenarios that would be recorded in one file are refused",
      same_name.returncode == 2 and same_name.stderr ==
      f"shiftrig: --record: scenarios {shift} and {other} would both be recorded as shift.lcmlog\n"
      and not os.listdir(recordings), same_name.stdout + same_name.stderr)
check("without --record they are run", run(shift, other).returncode == 0)
respelt = os.path.join(folder, ".", "shift.yaml")
twice = run(shift, respelt)
check("one scenario under two spellings is one given twice",
      twice.returncode == 2 and twice.stderr == f"shiftrig: scenario {respelt} is given twice\n", twice.stdout + twice.stderr)

good, worse = os.path.join(folder, "good.json"), os.path.join(folder, "bad.json")
for path, words, status in ((good, [], 0), (worse, ["--controller", "builtin:config/calibration/bad.yaml"], 1)):
    tested = run("config/scenarios/plough_upshift.yaml", "config/scenarios/creep.yaml", "--json", *words)
    check("--json ends as without it", tested.returncode == status, tested.stdout + tested.stderr)
    with open(path, "w") as file:
        file.write(tested.stdout)
first = json.load(open(good))["runs"][0]
check("--json says of each scenario whether it passed, and of each shift the scorecard",
      first["scenario"] == "config/scenarios/plough_upshift.yaml" and first["passed"] and first["failures"] == []
      and [(s["from"], s["to"], s["verdicts"]["duration_s"]) for s in first["shifts"]] == [("F2", "F3", "good")], first)
check("and why it failed", not json.load(open(worse))["runs"][0]["passed"] and json.load(open(worse))["runs"][0]["failures"])
compared = subprocess.run([shiftrig, "compare", good, worse], capture_output=True, text=True)
check("compare reads both and finds what got worse",
      compared.returncode == 1 and re.search(r"^plough_upshift F2->F3: .*, worse$", compared.stdout, re.M),
      compared.stdout + compared.stderr)
check("and nothing where nothing changed",
      subprocess.run([shiftrig, "compare", good, good], capture_output=True).returncode == 0)

lost = run(shift, "--record", recordings, restore_signals=False,  # SIGXFSZ stays ignored: the write fails instead
           preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20)))
check("a recording that is cut short by its disk is told and fails",
      lost.returncode == 1 and "shift.lcmlog: cannot be written: File too large\n" in lost.stdout, lost.stdout + lost.stderr)

missing = run("config/scenarios/nowhere.yaml")
check("a scenario that is not there is one line and exit code 2",
      missing.returncode == 2 and "config/scenarios/nowhere.yaml: cannot be read" in missing.stdout, missing.stdout)
sys.exit(1 if failures else 0)
