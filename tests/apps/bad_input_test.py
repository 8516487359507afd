"""Bad input as the user of `shiftrig run`, `fork` and `replay` meets it: one line that says where, what and which rule.

usage: bad_input_test.py SHIFTRIG SHIFTRIG_TCU CONFIG
"""
import json
import os
import re
import subprocess
import sys
import unittest

from programs import CONFIG, SHIFT, SHIFTRIG, TCU, InAFolder, command, free, run


class BadInput(InAFolder):
    def assert_one_line(self, done, pattern):
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertRegex(done.stderr, pattern)
        self.assertEqual(done.stdout, "")

    def test_a_picture_of_a_time_that_the_recording_does_not_have(self):
        recording, picture = self.path("short.lcmlog"), self.path("picture.svg")
        free("--duration", "0.5", "--record", recording)

        def plot(*window):
            return subprocess.run([SHIFTRIG, "plot", recording, "-o", picture, *window], capture_output=True, text=True)

        for window in (["--from", "50", "--until", "60"], ["--from", "50"], ["--from", "0.2001", "--until", "0.2002"]):
            self.assert_one_line(plot(*window),
                                 r"short\.lcmlog: no two ticks between [\d.]+ s and [\d.]+ s; it is from 0\.001 s to 0\.500 s$")
            self.assertFalse(os.path.exists(picture))
        self.assertEqual(plot("--from", "0.2").returncode, 0)

    def test_wrong_key(self):
        path, line = self.tractor_with("outer_radius_m", "outer_radius_mm")
        self.assert_one_line(run(path), re.escape(path) + ":%d:.*outer_radius_mm" % line)

    def test_negative_inertia(self):
        path, line = self.tractor_with("clutch_disc:  {inertia_kg_m2: 0.15", "clutch_disc:  {inertia_kg_m2: -0.15")
        self.assert_one_line(run(path), re.escape(path) + r':%d:.*mass "clutch_disc".*-0\.15; must be > 0' % line)

    def test_a_scenario_in_place_of_a_model(self):
        self.assert_one_line(run(SHIFT), "plough_upshift.yaml: .*--scenario")

    def test_two_shafts_without_a_mass_between_them(self):
        path, line = self.tractor_with("a: clutch_disc, b: input, stiffness", "a: clutch_disc, b: joint, stiffness")
        self.assert_one_line(run(path), re.escape(path) + ":%d:.*damper.*joint" % line)

    def test_missing_interface(self):
        self.assert_one_line(run("--scenario", SHIFT, "--bus", "can:nosuch0"), "can:nosuch0")
        self.assert_one_line(run("--bus", "can:nosuch0", program=TCU), "can:nosuch0")

    def test_lcm_without_a_multicast_route(self):
        alone = ("unshare", "--map-root-user", "--net")
        done = run("--scenario", SHIFT, "--bus", "lcm:udpm://239.255.76.67:7667?ttl=0", prefix=alone)
        self.assertEqual(done.returncode, 2)
        self.assertIn("ip route add", done.stderr)

    def test_unknown_bus_kernel_controller_and_files(self):
        for arguments, pattern in [
            (("--bus", "carrier:pigeon"), "carrier:pigeon: unknown kind"),
            (("--kernel", "abacus"), "abacus"),
            (("--rate-hz", "0"), "--rate-hz"),
            (("--duration", "1e-7"), "--duration: less than half a tick"),
            (("--controller", "builtin:nosuch.yaml"), "nosuch.yaml"),
            (("--can-replay", "nosuch.log"), "nosuch.log"),
            (("--bus", "inprocess", "--bus", "inprocess"), "only once"),
        ]:
            self.assert_one_line(run("--scenario", SHIFT, *arguments), pattern)
        self.assert_one_line(run("nosuch.yaml"), "nosuch.yaml")
        self.assert_one_line(run(), "a model or a scenario is needed")

    def test_what_a_snapshot_has_settled_is_not_asked_again(self):
        snapshot, log = self.path("s.snap"), self.path("from.log")
        free("--snapshot-at", "1", snapshot)
        settled = ": --from brings its own model, scenario, ticks, kernel, buses and controller$"
        for arguments, pattern in [
            (("tractor.yaml",), "MODEL" + settled),
            (("--scenario", SHIFT), "--scenario" + settled),
            (("--rate-hz", "500"), "--rate-hz" + settled),
            (("--substeps", "3"), "--substeps" + settled),
            (("--kernel", "portable"), "--kernel" + settled),
            (("--bus", "udpcan:nonsense", "--can-log", log), "--bus" + settled),
            (("--can-replay", "nosuch.log"), "--can-replay" + settled),
            (("--controller", "none"), "--controller none" + settled),
            (("--controller", "builtin:nosuch.yaml"), "--controller builtin:nosuch.yaml" + settled),
            (("--controller", "true"), "--controller: the controller of .*s.snap is the built-in one$"),
            (("--duration", "0.5"), r"--from .*s.snap: the snapshot is of 1 s, and the run ends at 0\.5 s \(--duration\)$"),
            (("--duration", "1"), r"--from .*s.snap: the snapshot is of 1 s, and the run ends at 1 s \(--duration\)$"),
        ]:
            self.assert_one_line(run("--from", snapshot, *arguments), pattern)
        self.assertFalse(os.path.exists(log))

    def test_a_snapshot_does_not_know_how_far_a_candump_log_was_played(self):
        log = self.path("shift.log")
        free("--can-log", log)
        self.assert_one_line(run("--scenario", SHIFT, "--can-replay", log, "--snapshot-at", "1", self.path("s.snap")),
                             "--snapshot-at: a run on --can-replay cannot go on from a snapshot$")

    def test_a_fork_without_a_branch_that_ran_fails(self):
        snapshot = self.path("s.snap")
        free("--snapshot-at", "2.14", snapshot)
        for values, code, told in (("-5,7000", 0, "refused: 1 of 2 branches"), ("-5", 2, "refused: 1 of 1 branches"),
                                   ("1e-300", 1, "not finite: 1 of 1 branches")):
            done = command("fork", snapshot, "--vary", "model.masses.vehicle.mass_kg=" + values)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(told, done.stderr)
        self.assert_one_line(command("fork", snapshot, "--vary", "clutch.F3.leak=0,2"),
                             "--vary clutch.F3.leak = 2; must be within 0 and 1$")

    def test_what_a_replay_holds_is_an_input_of_a_field_recording(self):
        field, recording = self.path("field.csv"), self.path("r.lcmlog")
        with open(field, "w") as file:
            file.write("time_s,driver.throttle,mass.engine.speed_rpm\n0,0.5,1000\n0.05,7,1000\n0.1,0.5,1000\n")
        replay = ("replay", field, "--model", CONFIG + "/tractor.yaml")
        done = command(*replay)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, field + ": driver.throttle must be within 0 and 1; limited in 1 of 3 rows\n")
        for held, pattern in (
                ("driver.thrrottle=0.5", "is no input of the model; nearest: driver.throttle$"),
                ("mass.vehicle.speed=3", "is no input of the model"),
                ("clutch.F2.pressure_command=18", "must be written with its unit: clutch.F2.pressure_command ends in _pa or _bar$"),
                ("environment.draft=100", "= 100; must be within 0 and 10$"),
                ("driver.throttle=1", "the recording or another --hold has it already$")):
            self.assert_one_line(command(*replay, "--hold", held), "--hold " + held.split("=")[0] + ".*" + pattern)
        free("--record", recording)
        for option in (("--hold", "environment.draft=1"), ("--locked", "Fc"), ("--step", "0.1")):
            self.assert_one_line(command("replay", recording, *option), option[0] + ": only of field recordings")

    def test_a_scenarios_missing_model_is_told_with_the_place_that_names_it(self):
        scenario = self.path("s.yaml")
        with open(scenario, "w") as file:
            file.write("about: none\nmodel: nosuch.yaml\nduration_s: 1\n")
        self.assert_one_line(run("--scenario", scenario), "^" + re.escape(
            scenario + ":2:1: model: " + self.path("nosuch.yaml") + ": cannot be read: No such file or directory") + "$")

    def test_a_gear_option_that_the_machine_does_not_have_is_told_with_its_place(self):
        recording, scenario = self.path("u.lcmlog"), self.path("s.yaml")
        two_masses = CONFIG + "/two_mass.yaml"
        with open(scenario, "w") as file:
            file.write("model: " + two_masses + "\nduration_s: 1\nstart:\n  options: {range: M}\n")
        self.assert_one_line(run("--scenario", scenario), re.escape(scenario) + ':4:3: no gear "range" with options$')
        free("--duration", "0.1", "--record", recording)
        self.assert_one_line(command("replay", recording, "--model", two_masses),
                             re.escape(two_masses) + ': no gear "range" with options, which the recorded run has in use$')
        field = self.path("f.csv")
        with open(field, "w") as file:
            file.write("time_s,mass.engine.speed_rpm\n0,1000\n0.05,1000\n")
        self.assert_one_line(command("replay", field, "--model", two_masses, "--option", "range=M"),
                             "^--option range=M: " + re.escape(two_masses) + ': no gear "range" with options$')

    def test_a_log_and_a_controller_do_not_both_drive(self):
        log = self.path("shift.log")
        free("--can-log", log, "--duration", "0.5")
        for controller in ("builtin", "sleep 10"):
            self.assert_one_line(run("--scenario", SHIFT, "--can-replay", log, "--controller", controller),
                                 "--can-replay and --controller " + controller + " exclude each other: the log takes the controller's place$")
        free("--can-replay", log, "--controller", "none")

    def test_nothing_is_varied_twice_and_hints_have_units(self):
        snapshot = self.path("s.snap")
        free("--snapshot-at", "2.14", snapshot)
        for variations, pattern in (
                (("clutch.F3.leak=0,0.1", "clutch.F3.leak=0.2"), r"--vary clutch\.F3\.leak: is varied already$"),
                (("environment.oil_temperature_degc=50", "environment.grade_percent=1", "environment.grade=0.1"),
                 r"--vary environment\.grade: is varied already, as environment\.grade_percent$"),
                (("calibration.shift.inertia_time_s=0.1",) * 2, r"--vary calibration\.shift\.inertia_time_s: is varied already$"),
                (("model.masses.vehicle.mass_kg=7000",) * 2, r"--vary model\.masses\.vehicle\.mass_kg: is varied already$"),
                (("environment.oil_temperature=90",),
                 r"--vary environment\.oil_temperature: must be written with its unit: environment\.oil_temperature ends in _degc$"),
                (("environment.oil_temprature_degc=90",), r"nearest: environment\.oil_temperature_degc, ")):
            self.assert_one_line(command("fork", snapshot, *(word for each in variations for word in ("--vary", each))), pattern)

    def test_recording_that_cannot_be_written(self):
        self.assert_one_line(run("--scenario", SHIFT, "--record", "/nosuch/dir/x.lcmlog"), "/nosuch/dir/x.lcmlog")

    def test_truncated_frames_are_counted_and_lead_to_the_safe_command(self):
        log = self.path("shift.log")
        free("--can-log", log)
        with open(log) as file:
            lines = file.read().splitlines()
        with open(log, "w") as file:
            for line in lines:  # from 3 s on, command frames lose their last byte
                late = float(line.split(")")[0][1:]) >= 3
                file.write((line.replace(line.split("#")[1].split()[0], line.split("#")[1].split()[0][:-2])
                            if late and "18FF1" in line else line) + "\n")
        done = run("--scenario", SHIFT, "--pace", "free", "--json", "--can-replay", log)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"inprocess ClutchCommandA: \d+ of wrong length")
        result = json.loads(done.stdout.splitlines()[-1])
        self.assertEqual(result["final"]["rig.safe_command"], 1)
        began = [e["time_s"] for e in result["events"] if e["kind"] == "safe_command"]
        self.assertEqual(len(began), 1)
        self.assertAlmostEqual(began[0], 3.1, delta=0.012)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
