"""`shiftrig run` and `shiftrig-tcu` as their user meets them: bad input, interruption, files left behind.

usage: run_command_test.py SHIFTRIG SHIFTRIG_TCU CONFIG
"""
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from in_a_folder import Folder

SHIFTRIG, TCU, CONFIG = sys.argv[1:4]
SHIFT = CONFIG + "/scenarios/plough_upshift.yaml"
MULTICAST = os.path.dirname(os.path.abspath(__file__)) + "/../io/with_multicast.sh"


def run(*arguments, program=SHIFTRIG, prefix=(), **options):
    command = [*prefix, program, *(["run"] if program == SHIFTRIG else []), *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240, **options)


def command(*arguments):
    return subprocess.run([SHIFTRIG, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240)


def free(*arguments, scenario=SHIFT):
    done = run("--scenario", scenario, "--pace", "free", "--json", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


class InAFolder(Folder):
    def tractor_with(self, old, new):
        """The tractor's file, changed in one place; returns its path and the line of the change."""
        with open(CONFIG + "/tractor.yaml") as file:
            text = file.read()
        self.assertIn(old, text)
        line = text[: text.index(old)].count("\n") + 1
        text = text.replace(old, new, 1).replace("can/tractor.yaml", CONFIG + "/can/tractor.yaml")
        with open(self.path("tractor.yaml"), "w") as file:
            file.write(text)
        return self.path("tractor.yaml"), line


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


class Results(InAFolder):
    def test_final_object(self):
        result = free()
        self.assertEqual(result["ticks"], 6000)
        self.assertAlmostEqual(result["sim_time_s"], 6)
        self.assertGreater(result["real_time_factor"], 1)
        self.assertEqual(result["overruns"], 0)
        self.assertEqual([s["to"] for s in result["shifts"]], ["F3"])
        self.assertGreater(len(result["events"]), 3)
        self.assertAlmostEqual(result["final"]["mass.vehicle.speed_m_s"] * 3.6, 8.63, delta=0.26)

    def test_the_plants_certificate_of_the_whole_run(self):
        certificate = free()["certificate"]
        self.assertLess(abs(certificate["torque_residual"]), 1e-12)
        self.assertLess(certificate["constraint_violation_rad_s"], 1e-10)
        self.assertLess(abs(certificate["energy_defect_j"]), 1)
        self.assertEqual(certificate["fall_backs"], 0)
        self.assertGreaterEqual(certificate["changes_located"], 2)  # F3 locks, F2 breaks away
        self.assertGreater(certificate["modes_built"], 2)
        self.assertEqual(certificate["ticks"],
                         {"tie_up": 0, "direction_search_gave_up": 0, "not_finite": 0, "coarse": None, "instant_not_found": 0})  # steps are taken whole
        recording = self.path("shift.lcmlog")
        text = run("--scenario", SHIFT, "--pace", "free", "--record", recording).stdout
        told = [e for e in json.loads(command("explain", recording, "--json").stdout) if e["device"]]
        self.assertIn(f"plant     {len(told)} events told, " + "%(changes_located)d changes located inside steps, 0 fall-backs, %(mode_lookups)d mode look-ups, %(modes_built)d modes built; "
                      "torque residual " % certificate, text)
        self.assertNotIn("of 6000 ticks", text)

    def test_the_energy_of_the_certificate_is_that_of_this_run(self):
        snapshot = self.path("s.snap")
        free("--snapshot-at", "5", snapshot)
        pattern = r"energy defect \S+ J of (\S+) J lost"
        whole = float(re.search(pattern, run("--scenario", SHIFT, "--pace", "free").stdout)[1])
        rest = float(re.search(pattern, run("--from", snapshot, "--pace", "free").stdout)[1])
        self.assertGreater(rest, 0.1 * whole)  # a sixth of the time
        self.assertLess(rest, 0.25 * whole)

    def test_a_snapshot_goes_on_at_any_pace_and_its_can_log_is_the_end_of_the_whole_ones(self):
        snapshot, whole, rest = self.path("s.snap"), self.path("whole.log"), self.path("rest.log")
        final = free("--snapshot-at", "2.2", snapshot, "--can-log", whole)["final"]
        for pace in ("free", "lockstep"):
            done = run("--from", snapshot, "--pace", pace, "--json", "--can-log", rest)
            self.assertEqual(done.returncode, 0, done.stderr)
            again = json.loads(done.stdout.splitlines()[-1])["final"]
            self.assertEqual({k for k in final if final[k] != again[k] and not k.startswith("certificate.mode_")}, set())
            with open(whole) as file:  # what was said at the end of the tick before is not said again
                expected = [line for line in file if float(line[1:18]) > 2.2]
            with open(rest) as file:
                found = [line for line in file if float(line[1:18]) > 2.2]
            self.assertEqual(found, expected)

    def test_ticks_whose_parts_stay_coarse_are_told(self):
        # A shaft that swings 16 rad a millisecond, in parts of 8.
        def machine_with(method):
            machine = self.path(method + ".yaml")
            with open(machine, "w") as file:
                file.write("name: swing\nmethod: " + method + "\nmaximum_parts: 2\nmasses:\n"
                           "  a: {inertia_kg_m2: 1, initial_speed_rad_s: 1}\n"
                           "  b: {inertia_kg_m2: 1, initial_speed_rad_s: -1}\n"
                           "shafts:\n  s: {a: a, b: b, stiffness_nm_per_rad: 1.28e8, damping_nm_s_per_rad: 0}\n")
            return machine
        for method in ("etd3", "ark3"):
            text = run(machine_with(method), "--pace", "free", "--controller", "none", "--duration", "0.1").stdout
            self.assertRegex(text, r"in \d+ of 100 ticks even the shortest parts of a step are coarse", method)

    def test_initial_speeds_that_contradict_a_gear_are_told(self):
        machine = self.path("geared.yaml")
        with open(machine, "w") as file:
            file.write("name: geared\nmasses: {a: {inertia_kg_m2: 1, initial_speed_rad_s: 10}, b: {inertia_kg_m2: 1}}\n"
                       "gears: {g: {a: a, b: b, ratio: 2, efficiency: 1}}\n")
        done = run(machine, "--pace", "free", "--controller", "none", "--duration", "0.01", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, 'initial speeds contradict gear "g": the run begins with "a" at 8 rad/s instead of 10, '
                                      '"b" at 4 rad/s instead of 0\n')
        self.assertAlmostEqual(json.loads(done.stdout)["final"]["mass.a.speed_rad_s"], 8, 12)

    def test_ticks_that_the_disk_did_not_take_are_not_proven(self):
        """A minute at fifty times real time, into a pipe that nobody reads for a while."""
        pipe, recording = self.path("pipe"), self.path("shift.lcmlog")
        os.mkfifo(pipe)

        def read_late():
            with open(pipe, "rb") as source, open(recording, "wb") as file:
                file.write(source.read(1 << 20))
                time.sleep(3)
                shutil.copyfileobj(source, file)

        reader = threading.Thread(target=read_late)
        reader.start()
        done = run("--scenario", SHIFT, "--duration", "60", "--factor", "50", "--catch-up", "100000", "--record", pipe)
        reader.join()
        self.assertRegex(done.stderr, r"pipe: \d+ ticks were not kept: the disk did not keep up\n")
        self.assertEqual(done.returncode, 1)
        lost = int(re.search(r"pipe: (\d+) ticks", done.stderr).group(1))
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 1, replayed.stderr + replayed.stdout)
        self.assertRegex(replayed.stdout, r"ticks agree bit for bit \(kernel \w+\)\n%d ticks are missing in the recording; " % lost)
        found = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
        self.assertEqual((found.returncode, json.loads(found.stdout)["agrees"], json.loads(found.stdout)["lost"]), (1, False, lost))

    def test_csv_has_every_tick_and_names_with_units(self):
        path = self.path("shift.csv")
        result = free("--csv", path)
        with open(path) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), result["ticks"])
        self.assertEqual(float(rows[-1]["mass.vehicle.speed_m_s"]), result["final"]["mass.vehicle.speed_m_s"])
        self.assertEqual(os.listdir(self.folder), ["shift.csv"])

    def test_csv_leaves_files_of_similar_names_alone(self):
        path, others = self.path("shift.csv"), ["shift.csv.lcmlog", "shift.lcmlog"]
        for name in others:
            with open(self.path(name), "w") as file:
                file.write("mine")
        free("--csv", path)
        for name in others:
            with open(self.path(name)) as file:
                self.assertEqual(file.read(), "mine")
        self.assertEqual(sorted(os.listdir(self.folder)), ["shift.csv", *others])

    def test_csv_that_cannot_be_written_leaves_nothing_behind(self):
        path = self.path("shift.csv")
        os.symlink("/dev/full", path)
        done = run("--scenario", SHIFT, "--pace", "free", "--csv", path, "--snapshot-at", "2", self.path("s.snap"))
        self.assertEqual(done.returncode, 1)
        self.assertIn(path + ": cannot be written: No space left on device\n", done.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), ["s.snap", "shift.csv"])
        done = run("--scenario", SHIFT, "--pace", "free", "--csv", "/nosuch/dir/shift.csv")
        self.assertEqual((done.returncode, done.stderr),
                         (2, "/nosuch/dir/shift.csv: cannot be written: No such file or directory\n"))

    def test_recording_replays_bit_for_bit_and_the_trace_is_json(self):
        recording, trace = self.path("shift.lcmlog"), self.path("trace.json")
        free("--record", recording, "--trace", trace)
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0, replayed.stderr + replayed.stdout)
        with open(trace) as file:
            self.assert_chrome_trace(json.load(file), ticks=6000)

    def noisy(self, seed):
        """A scenario in which a sensor is noisy; returns its path."""
        path = self.path(f"noisy_{seed}.yaml")
        with open(path, "w") as file:
            file.write(f"model: {CONFIG}/tractor.yaml\nduration_s: 1\nseed: {seed}\n"
                       "start: {inputs: {sensor.engine.noise_rpm: 20}}\n")
        return path

    def test_noise_is_replayed_and_gone_on_with_from_the_scenarios_seed(self):
        recording, snapshot = self.path("noisy.lcmlog"), self.path("half.lcmlog")
        noisy = self.noisy(7)
        whole = free("--record", recording, "--snapshot-at", "0.5", snapshot, scenario=noisy)
        with open(recording, "rb") as file:
            self.assertIn(b'"seed": 7', file.read())
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0, replayed.stderr + replayed.stdout)
        done = run("--from", snapshot, "--duration", "1", "--pace", "free", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        reading = "sensor.engine.speed_rad_s"
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["final"][reading], whole["final"][reading])
        self.assertNotEqual(free(scenario=self.noisy(8))["final"][reading], whole["final"][reading])

    # The Trace Event Format as chrome://tracing and ui.perfetto.dev read it.
    def assert_chrome_trace(self, trace, ticks):
        events = trace["traceEvents"]
        rows = {e["tid"]: e["args"]["name"] for e in events if e["ph"] == "M" and e["name"] == "thread_name"}
        spans = [e for e in events if e["ph"] == "X"]
        self.assertEqual(len(rows) + len(spans), len(events))
        for span in spans:
            self.assertIn(span["tid"], rows)
            self.assertGreaterEqual(span["ts"], 0)
            self.assertGreaterEqual(span["dur"], 0)
        self.assertEqual([e["args"]["slot"] for e in spans if e["name"] == "tick"], list(range(ticks)))

    def test_what_the_solver_says_of_itself_is_no_difference_of_machines(self):
        recording = self.path("shift.lcmlog")
        free("--record", recording)
        heavier, _ = self.tractor_with("vehicle:      {mass_kg: 14000", "vehicle:      {mass_kg: 14100")
        table = command("replay", recording, "--model", heavier)
        self.assertEqual(table.returncode, 0, table.stderr)
        signals = [line.split()[0] for line in table.stdout.splitlines()[1:]]
        deviations = [d["signal"] for d in json.loads(command("replay", recording, "--model", heavier, "--json").stdout)["deviations"]]
        self.assertIn("mass.vehicle.speed_m_s", signals)
        self.assertIn("energy.stored_j", deviations)
        for signal_name in signals + deviations:
            self.assertFalse(signal_name.startswith(("certificate.", "energy.defect")), signal_name)

    def test_a_recording_is_judged_as_its_run_was(self):
        recording = self.path("shift.lcmlog")
        judged = free("--record", recording)["shifts"]
        done = subprocess.run([SHIFTRIG, "report", recording, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["shifts"], judged)

    def test_candump_log_takes_the_controllers_place(self):
        log = self.path("shift.log")
        first = free("--can-log", log)
        second = free("--can-replay", log)
        self.assertEqual([(s["from"], s["to"], s["completed"]) for s in second["shifts"]], [("F2", "F3", True)])
        for one, other in zip(first["shifts"], second["shifts"]):
            self.assertAlmostEqual(one["ended_s"], other["ended_s"], delta=0.02)

    def test_a_log_that_does_not_fit_the_disk_fails_the_run(self):
        done = run("--scenario", SHIFT, "--pace", "free", "--can-log", "/dev/full")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("/dev/full: cannot be written: No space left on device", done.stderr.splitlines())

    def test_sigint_ends_the_run_with_everything_recorded(self):
        recording = self.path("cut.lcmlog")
        process = subprocess.Popen([SHIFTRIG, "run", "--scenario", SHIFT, "--pace", "wall", "--factor", "0.1", "--json",
                                    "--record", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not os.path.exists(recording) or os.path.getsize(recording) < 200000:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out.splitlines()[-1])
        self.assertEqual(result["loop"]["outcome"], "stopped")
        self.assertLess(result["ticks"], 6000)
        replayed = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0)
        self.assertEqual(json.loads(replayed.stdout)["ticks"], result["ticks"])

    def stopped(self, *arguments, after, by=signal.SIGTERM):
        """The signal once `after()` holds; the result, and the seconds that the program still took."""
        process = subprocess.Popen([MULTICAST, SHIFTRIG, "run", "--scenario", SHIFT, "--json", *arguments],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        while not after():
            self.assertIsNone(process.poll())
            time.sleep(0.05)
        time.sleep(0.5)
        asked = time.monotonic()
        process.send_signal(by)
        out, err = process.communicate(timeout=60)
        took = time.monotonic() - asked
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out.splitlines()[-1])
        self.assertEqual(result["loop"]["outcome"], "stopped")
        return result, took

    def test_sigterm_ends_a_run_in_any_pace_whatever_it_waits_for(self):
        recording, started = self.path("cut.lcmlog"), self.path("started")
        recorded = lambda: os.path.exists(recording) and os.path.getsize(recording) > 0
        for arguments, ticks in (
                (("--pace", "wall", "--rate-hz", "1", "--factor", "0.001"), 1),  # sleeps 1000 s
                (("--pace", "lockstep", "--bus", "udpcan:239.74.163.2:43113", "--answer-timeout", "3600"), 10),  # a command cycle
                (("--pace", "free", "--duration", "1e9"), None),
                (("--pace", "wall", "--controller", "touch " + started + "; sleep 1000", "--bus", "inprocess", "--controller-start", "3600"), 0)):
            with self.subTest(arguments):
                begun = recorded if ticks != 0 else lambda: os.path.exists(started)
                result, took = self.stopped(*arguments, "--record", recording, after=begun)
                self.assertLess(took, 5 if ticks is None else 2)  # the ticks of a free run are judged, too
                if ticks is not None:
                    self.assertLessEqual(result["ticks"], ticks)
                replayed = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
                self.assertEqual(replayed.returncode, 0)
                self.assertEqual(json.loads(replayed.stdout)["ticks"], result["ticks"])
                os.remove(recording)

    def test_the_end_of_the_terminal_ends_a_run_with_everything_kept(self):
        recording, table = self.path("cut.lcmlog"), self.path("cut.csv")
        recorded = lambda: os.path.exists(recording) and os.path.getsize(recording) > 200000
        result, _ = self.stopped("--factor", "0.1", "--record", recording, "--csv", table, after=recorded, by=signal.SIGHUP)
        with open(table) as file:
            self.assertEqual(len(file.readlines()), 1 + result["ticks"])
        replayed = command("replay", recording, "--json")
        self.assertEqual((replayed.returncode, json.loads(replayed.stdout)["ticks"]), (0, result["ticks"]))

    def test_nohup_outlives_the_terminal(self):
        recording = self.path("whole.lcmlog")
        process = subprocess.Popen(["nohup", SHIFTRIG, "run", "--scenario", SHIFT, "--factor", "4", "--json", "--record", recording],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not os.path.exists(recording) or os.path.getsize(recording) < 200000:
            time.sleep(0.05)
        process.send_signal(signal.SIGHUP)
        out, err = process.communicate(timeout=60)
        self.assertEqual((process.returncode, json.loads(out.splitlines()[-1])["loop"]["outcome"]), (0, "completed"), err)

    def test_a_controller_that_is_no_program_ends_the_run_before_it_begins(self):
        began = time.monotonic()
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "nixprog --now", "--controller-start", "60", "--json")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertEqual(done.stderr, 'controller "nixprog --now" could not be started: there is no program nixprog\n')
        self.assertLess(time.monotonic() - began, 30)
        # What the shell has to be asked is known once it has tried.
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "'nixprog'", "--controller-start", "0", "--json", "--factor", "4")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn('controller "\'nixprog\'" could not be started (status 127)', done.stderr.splitlines())
        self.assertEqual(json.loads(done.stdout)["ticks"], 6000)

    def test_a_run_that_does_not_begin_for_its_controller_leaves_its_files_as_they_were(self):
        with open(self.path("text"), "w") as file:
            file.write("#!/bin/sh\n")
        os.mkdir(self.path("folder"))
        for controller, why in (("nixprog", "there is no program nixprog"), (self.path("text"), self.path("text") + ": Permission denied"),
                                (self.path("none --x"), self.path("none") + ": No such file or directory"),
                                (self.path("folder"), self.path("folder") + ": Is a directory"), ("'nixprog'", None)):
            outputs = []
            for name in ("record.lcmlog", "table.csv", "trace.json", "can.log", "x.snap"):
                outputs.append(self.path(name))
                with open(outputs[-1], "w") as file:
                    file.write("mine")
            done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", controller, "--controller-start", "60", "--record", outputs[0],
                       "--csv", outputs[1], "--trace", outputs[2], "--can-log", outputs[3], "--snapshot-at", "1", outputs[4])
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            if why:
                self.assertEqual(done.stderr, f'controller "{controller}" could not be started: {why}\n')
            else:
                self.assertEqual(done.stderr.splitlines()[-1], f'controller "{controller}" could not be started (status 127)')
            for name in outputs:
                with open(name) as file:
                    self.assertEqual(file.read(), "mine", (name, controller))
            self.assertEqual(len(os.listdir(self.folder)), 7)

    def test_a_test_whose_controller_is_none_or_ends_fails_at_once(self):
        junit = self.path("junit.xml")
        lockstep = [MULTICAST, SHIFTRIG, "test", SHIFT, "--pace", "lockstep", "--bus", "udpcan:239.74.163.2:43113",
                    "--answer-timeout", "60", "--junit", junit, "--controller"]
        tested = lambda *more: subprocess.run(lockstep + list(more), capture_output=True, text=True, timeout=240)
        began = time.monotonic()
        done = tested("nixprog")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (2, "", 'controller "nixprog" could not be started: there is no program nixprog\n'))
        self.assertFalse(os.path.exists(junit))
        done = tested("'nixprog'")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stdout.splitlines()[1:-1],
                         [f'     {SHIFT}: controller "\'nixprog\'" could not be started (status 127)'])
        for controller, start, ended in (("exit 3", "0", "ended with status 3"), ("exit 0", "0.2", "ended with status 0"),
                                         ("sleep 0.4; kill -9 $$", "0", "was ended by signal 9")):
            done = tested(controller, "--controller-start", start)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            told = done.stdout.splitlines()[1:-1]
            self.assertEqual(len(told), 1, done.stdout)
            self.assertRegex(told[0], "^     " + re.escape(SHIFT) + r": after [\d.]+ s of 6 s its controller \"" + re.escape(controller)
                             + '" ' + ended + "$")
        kept = self.path("plough_upshift.lcmlog")
        with open(kept, "w") as file:
            file.write("mine")
        done = tested("exit 3", "--record", self.folder)
        with open(kept) as file:
            self.assertEqual((done.returncode, file.read()), (1, "mine"))
        self.assertLess(time.monotonic() - began, 30)  # of 60 s for each answer

    def test_controller_that_ends_is_told_and_the_safe_command_acts(self):
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "exit 3", "--pace", "wall", "--factor", "4",
                   "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('controller "exit 3" ended with status 3', done.stderr)
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["final"]["rig.safe_command"], 1)

    def test_lockstep_says_once_that_nobody_answers(self):
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "none", "--pace", "lockstep", "--duration", "0.5",
                   "--answer-timeout", "0.02", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = [line for line in done.stderr.splitlines() if "has not answered" in line]
        self.assertEqual(said, ["lockstep: the controller has not answered for 0.02 s (--answer-timeout); so long is waited "
                                "for each command cycle"])

    def test_nothing_but_the_result_where_there_is_no_terminal(self):
        done = run("--scenario", SHIFT, "--pace", "free")
        self.assertEqual(done.returncode, 0)
        self.assertNotIn("\r", done.stderr + done.stdout)


def at_wall_pace(*arguments, prefix=()):
    done = run("--scenario", SHIFT, "--pace", "wall", "--json", *arguments, prefix=prefix)
    return done, json.loads(done.stdout.splitlines()[-1])


class RealTime(InAFolder):
    # Two thousand times as fast as the clock: every tick is late.
    def test_too_many_late_ticks_in_a_row_end_the_run_where_that_is_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "1000000", "--late-limit", "50", "--when-late", "abort")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(result["loop"]["outcome"], "late_too_often")
        self.assertEqual(result["loop"]["late_runs"], 1)
        self.assertGreaterEqual(result["loop"]["longest_late_run"], 50)
        self.assertLess(result["ticks"], 6000)

    def test_late_ticks_are_only_counted_where_nothing_else_is_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "1000000", "--late-limit", "50")
        self.assertEqual(done.returncode, 0)
        self.assertEqual(result["ticks"], 6000)
        self.assertGreater(result["loop"]["late_runs"], 10)

    def test_too_far_behind_ends_the_run_or_skips_as_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "10", "--overrun", "abort")
        self.assertEqual((done.returncode, result["loop"]["outcome"]), (1, "too_far_behind"))
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "10")
        self.assertEqual((done.returncode, result["loop"]["outcome"]), (0, "completed"))
        self.assertGreater(result["loop"]["skipped"], 0)
        self.assertEqual(result["loop"]["executed"] + result["loop"]["skipped"], 6000)

    def test_without_privileges_it_runs_and_says_once_what_it_lacks_and_what_would_grant_it(self):
        prefix = ["prlimit", "--memlock=65536:65536", "--rtprio=0:0"]
        if os.geteuid() == 0:
            prefix += ["setpriv", "--bounding-set=-all", "--inh-caps=-all"]
        recording = self.path("poor.lcmlog")
        done, result = at_wall_pace("--factor", "4", "--record", recording, prefix=prefix)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(result["loop"]["executed"] + result["loop"]["skipped"], 6000)
        with open(recording, "rb") as file:
            kept = file.read().decode(errors="replace")
        for lacking in ("locked memory", "FIFO priority 80 for the plant thread"):
            lines = [line for line in done.stderr.splitlines() if lacking in line]
            self.assertEqual(len(lines), 1, done.stderr)
            self.assertIn("; to grant it: sudo setcap cap_sys_nice,cap_ipc_lock+ep ", lines[0])
            self.assertEqual([r["remedy"].startswith("sudo setcap") for r in result["not_granted"] if lacking in r["what"]], [True])
            self.assertIn(lacking, kept)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
